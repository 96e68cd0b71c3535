#define STRETCH_ALL_LOST 3 /* every channel is left out */

/* Why a channel is left out: stretch_loss(). */
#define STRETCH_IN_USE 0
#define STRETCH_LOST_MISSING 1 /* its samples are missing */
#define STRETCH_LOST_OUTSIDE 2 /* outside its range: disconnected, or the converter at its limit */
#define STRETCH_LOST_STILL 3   /* it repeats one value while others change */
#define STRETCH_LOST_SLIPPED 4 /* it jumped away from the value that the others predict */

typedef struct stretch_reading {
    float estimate; /* in STRETCH_UNIT */
    float sd;       /* standard deviation of the estimate with the remaining channels */
    uint16_t lost;  /* bit k is set if channel k is left out */
    uint8_t status;
    uint8_t clamped; /* 1 if a state was outside the calibrated domain */
} stretch_reading;

@if several
#define STRETCH_JUMP 8 /* number of ticks in which a jump is searched */

@end
typedef struct stretch_channel {
    float last;
@if relaxes
    float low_passes[STRETCH_RELAXATIONS];
@end
@if several
    float differences[STRETCH_JUMP]; /* from the prediction of the others, one per tick */
@end
    float held;       /* the value that is repeated */
    uint16_t repeats; /* how often recently; 0 before the first sample */
    uint32_t good;    /* while it is left out: samples in a row without a fault */
    uint8_t begun;
    uint8_t missing;
    uint8_t loss;
} stretch_channel;

typedef struct stretch_state {
    stretch_channel of[STRETCH_CHANNELS];
    uint8_t silent; /* consecutive samples that no channel in use had */
    uint8_t warmed; /* ticks in which the channels were compared */
    uint16_t tick;  /* samples since the last tick */
} stretch_state;

/* Resets a channel, except for whether it is left out. */
static STRETCH_APART void stretch_forget(stretch_channel *c)
{
@if relaxes several
    int k;
@end
    c->last = 0.0f;
@if relaxes
    for (k = 0; k < STRETCH_RELAXATIONS; k++) {
        c->low_passes[k] = 0.0f;
    }
@end
@if several
    for (k = 0; k < STRETCH_JUMP; k++) {
        c->differences[k] = 0.0f;
    }
@end
    c->held = 0.0f;
    c->repeats = 0;
    c->good = 0;
    c->begun = 0;
    c->missing = 0;
}

/* Uses a channel again that was left out, as if its next sample were its first. */
static STRETCH_APART void stretch_readmit(stretch_state *s, int channel)
{
    if (channel >= 0 && channel < STRETCH_CHANNELS) {
        stretch_forget(&s->of[channel]);
        s->of[channel].loss = STRETCH_IN_USE;
        s->warmed = 0;
    }
}

static inline void stretch_init(stretch_state *s)
{
    int k;
    for (k = 0; k < STRETCH_CHANNELS; k++) {
        stretch_readmit(s, k);
    }
    s->silent = 0;
    s->warmed = 0;
    s->tick = 0;
}

/* Why a channel is left out; STRETCH_IN_USE if it is not. */
static inline uint8_t stretch_loss(const stretch_state *s, int channel)
{
    return channel >= 0 && channel < STRETCH_CHANNELS ? s->of[channel].loss : STRETCH_IN_USE;
}

STRETCH_INLINE stretch_reading stretch_answer(uint8_t status)
{
    stretch_reading reading;
    reading.estimate = 0.0f;
    reading.sd = 0.0f;
    reading.lost = 0;
    reading.status = status;
    reading.clamped = 0;
    return reading;
}

/* ---- a channel's sample ---- */

/* Takes a new sample, or the last one again. */
STRETCH_INLINE void stretch_pass(stretch_channel *c, float x)
{
@if relaxes
    int k;
    if (!c->begun) {
        for (k = 0; k < STRETCH_RELAXATIONS; k++) {
            c->low_passes[k] = x;
        }
    }
    for (k = 0; k < STRETCH_RELAXATIONS; k++) {
        c->low_passes[k] =
            c->low_passes[k] + STRETCH_FLOAT(stretch_shares[k]) * (x - c->low_passes[k]);
    }
@end
    c->last = x;
    c->begun = 1;
}

/* How often one value was repeated recently: a repetition adds one, another value subtracts one. */
STRETCH_INLINE uint16_t stretch_repeats(stretch_channel *c, float x, int others_change)
{
    if (c->repeats > 0 && !(x < c->held) && !(x > c->held)) {
        if (others_change && c->repeats < 65535u) {
            c->repeats = (uint16_t)(c->repeats + 1u);
        }
    } else if (c->repeats > 1) {
        c->repeats = (uint16_t)(c->repeats - 1u);
    } else {
        c->held = x;
        c->repeats = 1;
    }
    return c->repeats;
}

STRETCH_INLINE int stretch_possible(int k, float x)
{
    return stretch_usable(x) && x >= STRETCH_FLOAT(stretch_least[k]) &&
           x <= STRETCH_FLOAT(stretch_most[k]);
}

/* Takes a sample. Returns why the channel is lost, or STRETCH_IN_USE. */
STRETCH_INLINE uint8_t stretch_take(stretch_channel *c, int k, float x, int others_change)
{
    if (!stretch_possible(k, x)) {
        if (c->missing >= STRETCH_MAX_BRIDGED) {
            return stretch_usable(x) ? STRETCH_LOST_OUTSIDE : STRETCH_LOST_MISSING;
        }
        c->missing = (uint8_t)(c->missing + 1u);
        if (c->begun) {
            stretch_pass(c, c->last);
        }
        return STRETCH_IN_USE;
    }
    c->missing = 0;
    if (stretch_repeats(c, x, others_change) >= STRETCH_INT(stretch_still[k])) {
        return STRETCH_LOST_STILL;
    }
    stretch_pass(c, x);
    return STRETCH_IN_USE;
}

/* Takes a sample of a channel that is left out. Returns whether enough samples in a row have had no fault. */
static STRETCH_APART int stretch_recovered(stretch_channel *c, int k, float x, int others_change)
{
    if (!stretch_possible(k, x) || stretch_repeats(c, x, others_change) >= STRETCH_INT(stretch_still[k])) {
        stretch_forget(c);
        return 0;
    }
    c->good = c->good + 1u;
    return c->good >= STRETCH_RECOVERY;
}

@if several
/* ---- comparison of the channels ---- */

/* The signed distance between the range of the last four differences and that of the four before; zero
 * if the ranges overlap. */
STRETCH_INLINE float stretch_jump(stretch_channel *c, float difference)
{
    float least[2], most[2];
    int half, k;
    for (k = 1; k < STRETCH_JUMP; k++) {
        c->differences[k - 1] = c->differences[k];
    }
    c->differences[STRETCH_JUMP - 1] = difference;
    for (half = 0; half < 2; half++) {
        const float *values = c->differences + half * (STRETCH_JUMP / 2);
        least[half] = values[0];
        most[half] = values[0];
        for (k = 1; k < STRETCH_JUMP / 2; k++) {
            least[half] = values[k] < least[half] ? values[k] : least[half];
            most[half] = values[k] > most[half] ? values[k] : most[half];
        }
    }
    if (least[1] - most[0] > 0.0f) {
        return least[1] - most[0];
    }
    return most[1] - least[0] < 0.0f ? most[1] - least[0] : 0.0f;
}

/* The channel whose slip explains the jumps best; -1 if there is none. */
static STRETCH_APART int stretch_cause(const float *jumps)
{
    float most = 0.0f;
    int cause = -1, j, k;
    for (k = 0; k < STRETCH_CHANNELS; k++) {
        float along = 0.0f, power = 0.0f, explained;
        for (j = 0; j < STRETCH_CHANNELS; j++) {
            const float per_slip = STRETCH_FLOAT(stretch_per_slip[j]);
            const float moved = j == k ? per_slip : -(STRETCH_FLOAT(stretch_follows[j][k]) * per_slip);
            along = along + moved * jumps[j];
            power = power + moved * moved;
        }
        explained = along * along / power;
        if (explained > most) {
            most = explained;
            cause = k;
        }
    }
    return cause;
}

/* Compares the channels on every tick, as long as none is left out. */
STRETCH_INLINE void stretch_watch(stretch_state *s)
{
    float jumps[STRETCH_CHANNELS];
    int exceeds = 0, j, k;
    for (k = 0; k < STRETCH_CHANNELS; k++) {
        if (s->of[k].loss != STRETCH_IN_USE) {
            return;
        }
    }
    s->tick = (uint16_t)(s->tick + 1u);
    if (s->tick < STRETCH_SAMPLES_A_TICK) {
        return;
    }
    s->tick = 0;
    s->warmed = (uint8_t)(s->warmed < 255u ? s->warmed + 1u : 255u);
    for (k = 0; k < STRETCH_CHANNELS; k++) {
        float told = 0.0f;
        for (j = 0; j < STRETCH_CHANNELS; j++) {
            told = told + STRETCH_FLOAT(stretch_follows[k][j]) * s->of[j].last;
        }
        jumps[k] =
            stretch_jump(&s->of[k], s->of[k].last - told) * STRETCH_FLOAT(stretch_per_slip[k]);
        exceeds |= jumps[k] > 1.0f || jumps[k] < -1.0f;
    }
    if (exceeds && s->warmed >= STRETCH_JUMP) {
        const int cause = stretch_cause(jumps);
        if (cause >= 0) {
            s->of[cause].loss = STRETCH_LOST_SLIPPED;
        }
    }
}

@end
/* ---- the estimate ---- */

/* Adds the terms of one channel to a sum; gains is a row of a table. */
STRETCH_INLINE float stretch_add(const stretch_channel *c, int k, const float *gains, float sum,
                                 uint8_t *clamped)
{
    float states[STRETCH_STATES], made[STRETCH_TERMS];
    int i;
    states[0] = c->last;
@if relaxes
    for (i = 0; i < STRETCH_RELAXATIONS; i++) {
        states[i + 1] = (i == 0 ? c->last : c->low_passes[i - 1]) - c->low_passes[i];
    }
@end
    for (i = 0; i < STRETCH_STATES; i++) {
        const float scaled =
            (states[i] - STRETCH_FLOAT(stretch_centre[k][i])) * STRETCH_FLOAT(stretch_per_half[k][i]);
        states[i] = scaled > -1.0f ? scaled : -1.0f;
        states[i] = states[i] < 1.0f ? states[i] : 1.0f;
        *clamped = (uint8_t)(*clamped | (scaled < -1.0f || scaled > 1.0f));
    }
    for (i = 0; i < STRETCH_TERMS; i++) {
        const uint8_t parent = STRETCH_BYTE(stretch_parents[i]);
        made[i] = (parent == 0 ? 1.0f : made[parent - 1]) * states[STRETCH_BYTE(stretch_extends[i])];
        sum = sum + STRETCH_FLOAT(gains[i]) * made[i];
    }
    return sum;
}

/* The estimate from the remaining channels: all, all but one, or the best one alone. */
STRETCH_INLINE stretch_reading stretch_estimate(const stretch_state *s)
{
    stretch_reading reading = stretch_answer(STRETCH_OK);
    const float(*gains)[STRETCH_TERMS] = stretch_all;
    int left = 0, last_lost = -1, best = -1, k;
    float sum = STRETCH_CONSTANT;
    reading.sd = STRETCH_SD;
    for (k = 0; k < STRETCH_CHANNELS; k++) {
        if (s->of[k].loss == STRETCH_IN_USE) {
            left++;
            if (best < 0 ||
                STRETCH_FLOAT(stretch_alone_sd[k]) < STRETCH_FLOAT(stretch_alone_sd[best])) {
                best = k;
            }
        } else {
            last_lost = k;
            reading.lost = (uint16_t)(reading.lost | (1u << k));
        }
    }
    if (best < 0) {
        return stretch_answer(STRETCH_ALL_LOST);
    }
    if (left + 1 < STRETCH_CHANNELS) {
        sum = stretch_add(&s->of[best], best, stretch_alone[best],
                          STRETCH_FLOAT(stretch_alone_constant[best]), &reading.clamped);
        reading.sd = STRETCH_FLOAT(stretch_alone_sd[best]);
    } else {
@if several
        if (last_lost >= 0) {
            gains = stretch_without + last_lost * STRETCH_CHANNELS;
            sum = STRETCH_FLOAT(stretch_without_constant[last_lost]);
            reading.sd = STRETCH_FLOAT(stretch_without_sd[last_lost]);
        }
@end
        for (k = 0; k < STRETCH_CHANNELS; k++) {
            if (k != last_lost) {
                sum = stretch_add(&s->of[k], k, gains[k], sum, &reading.clamped);
            }
        }
    }
    sum = sum > STRETCH_LOW ? sum : STRETCH_LOW;
    reading.estimate = sum < STRETCH_HIGH ? sum : STRETCH_HIGH;
    return reading;
}

/* ---- samples in, a reading out ---- */

/* Takes a sample that is missing in all channels in use, because the recorder is silent. */
static STRETCH_APART stretch_reading stretch_lost(stretch_state *s)
{
    int in_use = 0, waiting = 0, k;
    s->warmed = 0;
    s->silent = (uint8_t)(s->silent < 255u ? s->silent + 1u : 255u);
    for (k = 0; k < STRETCH_CHANNELS; k++) {
        if (s->of[k].loss == STRETCH_IN_USE) {
            in_use = 1;
            waiting |= !s->of[k].begun;
        }
    }
    if (!in_use) {
        return stretch_answer(STRETCH_ALL_LOST);
    }
    for (k = 0; k < STRETCH_CHANNELS; k++) {
        if (s->of[k].loss != STRETCH_IN_USE) {
            continue;
        }
        if (waiting) {
            stretch_forget(&s->of[k]);
        } else {
            stretch_pass(&s->of[k], s->of[k].last);
        }
    }
    if (waiting || s->silent > STRETCH_MAX_BRIDGED) {
        return stretch_answer(STRETCH_MISSING);
    }
    return stretch_estimate(s);
}

/* Takes one sample per channel, in the unit of the signals; NaN or STRETCH_NO_SIGNAL is a missing sample. */
static STRETCH_APART stretch_reading stretch_step(stretch_state *s, const float *samples)
{
    int change = 0, heard = 0, waiting = 0, k;
    for (k = 0; k < STRETCH_CHANNELS; k++) {
        const stretch_channel *c = &s->of[k];
        if (c->loss == STRETCH_IN_USE && stretch_usable(samples[k])) {
            change |= !c->begun || !(samples[k] >= c->last && samples[k] <= c->last);
        }
    }
    for (k = 0; k < STRETCH_CHANNELS; k++) {
        stretch_channel *c = &s->of[k];
        if (c->loss != STRETCH_IN_USE && c->loss != STRETCH_LOST_SLIPPED &&
            stretch_recovered(c, k, samples[k], change)) {
            stretch_readmit(s, k);
        }
        heard |= c->loss == STRETCH_IN_USE && stretch_usable(samples[k]);
    }
    if (!heard) {
        return stretch_lost(s);
    }
    s->silent = 0;
    for (k = 0; k < STRETCH_CHANNELS; k++) {
        stretch_channel *c = &s->of[k];
        if (c->loss == STRETCH_IN_USE) {
            c->loss = stretch_take(c, k, samples[k], change);
            waiting |= c->loss == STRETCH_IN_USE && !c->begun;
        }
    }
    if (waiting) {
        return stretch_answer(STRETCH_WARMING);
    }
@if several
    stretch_watch(s);
@end
    return stretch_estimate(s);
}
