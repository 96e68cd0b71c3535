/* Fractional bits: targets, drives and rates per sample 26, weights 20, places between
 * knots 16, shares 31. Signals are in 2^-12 of a 16-bit sample, signed by polarity. */

typedef struct stretch_state {
    int32_t target;
    int32_t rate; /* per sample, not per second */
    int32_t slow[2];
    int32_t plays[3];
    int32_t baseline;
    int32_t excess;
    uint8_t begun;
    uint8_t branch;
    uint8_t missing;
} stretch_state;

/* Resets all but branch and baseline. */
static inline void stretch_forget(stretch_state *s)
{
    int k;
    s->target = 0;
    s->rate = 0;
    for (k = 0; k < 2; k++) {
        s->slow[k] = 0;
    }
    for (k = 0; k < 3; k++) {
        s->plays[k] = 0;
    }
    s->begun = 0;
}

static inline void stretch_init(stretch_state *s)
{
    stretch_forget(s);
    s->baseline = 0;
    s->excess = 0;
    s->branch = STRETCH_TARGET_RISES;
    s->missing = STRETCH_MAX_BRIDGED;
}

STRETCH_INLINE int32_t stretch_saturate(int64_t x)
{
    if (x > INT32_MAX) {
        return INT32_MAX;
    }
    return x < INT32_MIN ? INT32_MIN : (int32_t)x;
}

/* x limited to low .. high */
STRETCH_INLINE int32_t stretch_held(int32_t x, int32_t low, int32_t high)
{
    if (x < low) {
        x = low;
    }
    return x > high ? high : x;
}

/* A share of a number, rounded to the nearest. */
STRETCH_INLINE int32_t stretch_part(int32_t x, int32_t share)
{
    return (int32_t)((stretch_product(x, share) + ((int64_t)1 << 30)) >> 31);
}

/* Backlash: stays within radius of x. */
STRETCH_INLINE int32_t stretch_play(int32_t before, int32_t x, int32_t radius)
{
    return stretch_held(before, x - radius, x + radius);
}

/* The place on the curve, in knots, that gives a signal; *held: the signal, limited to the curve. */
STRETCH_INLINE int32_t stretch_inverse(int32_t signal, int32_t *held)
{
    int below = 0, above = STRETCH_KNOTS - 1;
    *held = stretch_held(signal, STRETCH_INT(stretch_curve[0]),
                         STRETCH_INT(stretch_curve[STRETCH_KNOTS - 1]));
    while (above - below > 1) {
        const int middle = (below + above) / 2;
        if (STRETCH_INT(stretch_curve[middle]) <= *held) {
            below = middle;
        } else {
            above = middle;
        }
    }
    return (int32_t)below * 65536 +
           (int32_t)(stretch_product(*held - STRETCH_INT(stretch_curve[below]),
                                     STRETCH_INT(stretch_recips[below])) >>
                     STRETCH_RECIP_BITS);
}

/* The signal at a drive; *segment: that of the drive; *place: in knots, limited to the curve. */
STRETCH_INLINE int32_t stretch_forward(int32_t drive, int32_t *segment, int32_t *place)
{
    const int32_t from_low = stretch_saturate((int64_t)drive - STRETCH_DRIVE_LOW);
    int32_t at = stretch_saturate(stretch_product(from_low, STRETCH_PER_STEP) >> 32);
    int32_t below, knot;
    at = stretch_held(at, 0, (int32_t)(STRETCH_KNOTS - 1) * 65536);
    below = at >> 16;
    if (below > STRETCH_KNOTS - 2) {
        below = STRETCH_KNOTS - 2;
    }
    *segment = below;
    *place = at;
    knot = STRETCH_INT(stretch_curve[below]);
    return knot +
           (int32_t)(stretch_product(STRETCH_INT(stretch_curve[below + 1]) - knot,
                                     at - below * 65536) >>
                     16);
}

/* The drive if the target is at y and moves by rate per sample. */
STRETCH_INLINE int32_t stretch_drive(const stretch_state *s, int32_t y, int32_t rate)
{
    const int64_t most = (int64_t)1 << 30;
    int64_t sum = stretch_product(STRETCH_LEAD, rate);
    int i;
    for (i = 0; i < STRETCH_RELAXATIONS; i++) {
        sum += stretch_product(STRETCH_INT(stretch_amplitudes[i]), y - s->slow[i]);
    }
    for (i = 0; i < STRETCH_PLAYS; i++) {
        const int32_t played = stretch_play(s->plays[i], y, STRETCH_INT(stretch_radii[i]));
        sum += stretch_product(STRETCH_INT(stretch_play_weights[i]), y - played);
    }
    sum = (int64_t)y + (sum >> 20);
    if (sum > most) {
        sum = most;
    }
    return (int32_t)(sum < -most ? -most : sum);
}

/* Advances the states by one sample. */
STRETCH_INLINE void stretch_predict(stretch_state *s)
{
    int i;
    s->target = stretch_held(s->target + s->rate, STRETCH_LOW, STRETCH_HIGH);
    for (i = 0; i < STRETCH_RELAXATIONS; i++) {
        s->slow[i] += stretch_part(s->target - s->slow[i], STRETCH_INT(stretch_shares[i]));
    }
}

/* Keeps the target in its range. At an end of the range, the rate cannot lead outwards. */
STRETCH_INLINE void stretch_hold(stretch_state *s)
{
    int i;
    if (s->target < STRETCH_LOW) {
        s->target = STRETCH_LOW;
        s->rate = s->rate > 0 ? s->rate : 0;
    }
    if (s->target > STRETCH_HIGH) {
        s->target = STRETCH_HIGH;
        s->rate = s->rate < 0 ? s->rate : 0;
    }
    for (i = 0; i < STRETCH_PLAYS; i++) {
        s->plays[i] = stretch_play(s->plays[i], s->target, STRETCH_INT(stretch_radii[i]));
    }
}

/* Product of a gain and a surprise (signal minus predicted signal), rounded. */
STRETCH_INLINE int32_t stretch_pull(int32_t gain, int32_t surprise)
{
    return stretch_saturate((stretch_product(gain, surprise) + STRETCH_GAIN_HALF) >>
                            STRETCH_GAIN_BITS);
}

/* Corrects the states with a signal above its baseline. Returns whether it lay on the curve. */
STRETCH_INLINE int stretch_correct(stretch_state *s, int32_t signal)
{
    const int32_t first = STRETCH_INT(stretch_curve[0]);
    const int32_t last = STRETCH_INT(stretch_curve[STRETCH_KNOTS - 1]);
    const int32_t *gains;
    int32_t segment, from, held, to, run, change, surprise, predicted;
    int at, i;
    predicted = stretch_forward(stretch_drive(s, s->target, s->rate), &segment, &from);
    to = stretch_inverse(signal, &held);
    at = (int)STRETCH_INT(stretch_tangents[segment]);
    run = to > from ? to - from : from - to;
    change = held > predicted ? held - predicted : predicted - held;
    /* the secant, if it is steeper and spans at least a hundredth of the distance between knots */
    if (run > 65536 / 100) {
        const int64_t scaled = (int64_t)change * 65536;
        while (at < STRETCH_SLOPES - 1 && scaled >= stretch_product(STRETCH_INT(stretch_ends[at]), run)) {
            at++;
        }
    }
    /* a spike is limited to one span of the curve beyond its ends */
    surprise = stretch_held(signal, first - (last - first), last + (last - first)) - predicted;
    gains = stretch_gains[at];
    s->target = stretch_saturate((int64_t)s->target + stretch_pull(STRETCH_INT(gains[0]), surprise));
    s->rate = stretch_held(
        stretch_saturate((int64_t)s->rate + stretch_pull(STRETCH_INT(gains[1]), surprise)),
        -((int32_t)1 << 26), (int32_t)1 << 26);
    for (i = 0; i < STRETCH_RELAXATIONS; i++) {
        s->slow[i] = stretch_held(
            stretch_saturate((int64_t)s->slow[i] +
                             stretch_pull(STRETCH_INT(gains[2 + i]), surprise)),
            -((int32_t)1 << 29), (int32_t)1 << 29);
    }
    stretch_hold(s);
    return held == signal;
}

#if STRETCH_FOLLOWS_REST
/* Returns the signal above the baseline, and updates the baseline. */
STRETCH_INLINE int32_t stretch_above_rest(stretch_state *s, int32_t signal)
{
    int32_t shift = 0, segment, place, excess, before;
    if (s->begun) {
        shift = stretch_forward(stretch_drive(s, STRETCH_LOW, 0), &segment, &place) -
                STRETCH_AT_REST;
    }
    excess = stretch_saturate((int64_t)signal - s->baseline);
    excess = stretch_saturate((int64_t)excess - (STRETCH_REST_LEVEL + shift));
    excess = stretch_held(excess, -STRETCH_REST_MOST, STRETCH_REST_MOST);
    s->excess += stretch_part(excess - s->excess, STRETCH_REST_AVERAGE);
    before = s->baseline;
    s->baseline = stretch_held(
        before + (s->excess < 0 ? stretch_part(s->excess, STRETCH_REST_PULL) : STRETCH_REST_LEAK),
        -STRETCH_REST_FURTHEST, STRETCH_REST_FURTHEST);
    s->excess -= s->baseline - before;
    return signal - s->baseline;
}
#endif

static STRETCH_APART void stretch_begin(stretch_state *s, int32_t signal)
{
    int32_t held;
    const int64_t place = (int64_t)stretch_inverse(signal, &held);
    const int64_t drive = (place * ((int64_t)1 << 32)) / STRETCH_PER_STEP + STRETCH_DRIVE_LOW;
    const int32_t target = stretch_held(stretch_saturate(drive), STRETCH_LOW, STRETCH_HIGH);
    int i;
    s->target = target;
    s->rate = 0;
    for (i = 0; i < 2; i++) {
        s->slow[i] = target;
    }
    for (i = 0; i < 3; i++) {
        s->plays[i] = target;
    }
    s->begun = 1;
}

static STRETCH_APART void stretch_missed(stretch_state *s)
{
    if (!s->begun) {
        return;
    }
    if (s->missing < STRETCH_MAX_BRIDGED) {
        /* bridged by the predicted motion */
        s->missing = (uint8_t)(s->missing + 1u);
    } else {
        /* in a longer gap, the target is assumed to rest */
        s->rate = 0;
    }
    stretch_predict(s);
    stretch_hold(s);
}

/* Takes a missing sample. */
static inline stretch_reading stretch_lost(stretch_state *s)
{
    stretch_missed(s);
    return stretch_answer(STRETCH_MISSING, s->branch, STRETCH_INSIDE, 0);
}

/* Takes a code of the converter; any other number is a missing sample. */
static inline stretch_reading stretch_step(stretch_state *s, int32_t code)
{
    int32_t signal;
    int64_t scaled;
    int on_curve;
    if ((uint32_t)code >= STRETCH_CODES) {
        return stretch_lost(s);
    }
    s->missing = 0;
    signal = code * STRETCH_SIGNAL_PER_CODE;
#if STRETCH_FOLLOWS_REST
    signal = stretch_above_rest(s, signal);
#endif
    if (s->begun) {
        stretch_predict(s);
    } else {
        stretch_begin(s, signal);
    }
    on_curve = stretch_correct(s, signal);
    if (s->rate > STRETCH_DEAD_BAND) {
        s->branch = STRETCH_TARGET_RISES;
    } else if (s->rate < -STRETCH_DEAD_BAND) {
        s->branch = STRETCH_TARGET_FALLS;
    }
    scaled = STRETCH_ZERO + stretch_product(STRETCH_GAIN, s->target);
    return stretch_answer(STRETCH_OK, s->branch, on_curve ? STRETCH_INSIDE : STRETCH_SIGNAL_CLAMPED,
                          stretch_saturate(scaled >> STRETCH_OUTPUT_SHIFT));
}

