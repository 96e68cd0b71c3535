typedef struct stretch_state {
    float target;
    float rate;
    float slow[2];
    float plays[3];
    float baseline;
    float excess;
    uint8_t begun;
    uint8_t branch;
    uint8_t missing;
} stretch_state;

/* Resets all but branch and baseline. */
static inline void stretch_forget(stretch_state *s)
{
    int k;
    s->target = 0.0f;
    s->rate = 0.0f;
    for (k = 0; k < 2; k++) {
        s->slow[k] = 0.0f;
    }
    for (k = 0; k < 3; k++) {
        s->plays[k] = 0.0f;
    }
    s->begun = 0;
}

static inline void stretch_init(stretch_state *s)
{
    stretch_forget(s);
    s->baseline = 0.0f;
    s->excess = 0.0f;
    s->branch = STRETCH_TARGET_RISES;
    s->missing = STRETCH_MAX_BRIDGED;
}

/* x limited to low .. high */
STRETCH_INLINE float stretch_held(float x, float low, float high)
{
    if (x < low) {
        x = low;
    }
    return x > high ? high : x;
}

/* Backlash: stays within radius of x. */
STRETCH_INLINE float stretch_play(float before, float x, float radius)
{
    return stretch_held(before, x - radius, x + radius);
}

/* The drive at which the curve gives a signal; *held: the signal, limited to the curve. */
STRETCH_INLINE float stretch_inverse(float signal, float *held)
{
    int below = 0, above = STRETCH_KNOTS - 1;
    float place, knot;
    *held = stretch_held(signal, STRETCH_FLOAT(stretch_curve[0]),
                         STRETCH_FLOAT(stretch_curve[STRETCH_KNOTS - 1]));
    while (above - below > 1) {
        const int middle = (below + above) / 2;
        if (STRETCH_FLOAT(stretch_curve[middle]) <= *held) {
            below = middle;
        } else {
            above = middle;
        }
    }
    knot = STRETCH_FLOAT(stretch_curve[below]);
    place = (float)below + (*held - knot) / (STRETCH_FLOAT(stretch_curve[below + 1]) - knot);
    return STRETCH_DRIVE_LOW + place * STRETCH_DRIVE_STEP;
}

/* The signal at a drive; *tangent: the slope there; *held: the drive, limited to the curve. */
STRETCH_INLINE float stretch_forward(float drive, float *tangent, float *held)
{
    const float place = stretch_held((drive - STRETCH_DRIVE_LOW) * STRETCH_PER_STEP, 0.0f,
                                     (float)(STRETCH_KNOTS - 1));
    int below = (int)place;
    float rise, knot;
    if (below > STRETCH_KNOTS - 2) {
        below = STRETCH_KNOTS - 2;
    }
    knot = STRETCH_FLOAT(stretch_curve[below]);
    rise = STRETCH_FLOAT(stretch_curve[below + 1]) - knot;
    *tangent = rise * STRETCH_PER_STEP;
    *held = STRETCH_DRIVE_LOW + place * STRETCH_DRIVE_STEP;
    return knot + (place - (float)below) * rise;
}

/* The drive if the target is at y now. */
STRETCH_INLINE float stretch_drive(const stretch_state *s, float y)
{
    float drive = y;
    int i;
    for (i = 0; i < STRETCH_RELAXATIONS; i++) {
        drive = drive + STRETCH_FLOAT(stretch_amplitudes[i]) * (y - s->slow[i]);
    }
    for (i = 0; i < STRETCH_PLAYS; i++) {
        const float played = stretch_play(s->plays[i], y, STRETCH_FLOAT(stretch_radii[i]));
        drive = drive + STRETCH_FLOAT(stretch_play_weights[i]) * (y - played);
    }
    return drive;
}

/* Advances the states by one sample. */
STRETCH_INLINE void stretch_predict(stretch_state *s)
{
    int i;
    s->target = stretch_held(s->target + STRETCH_PERIOD_S * s->rate, STRETCH_LOW, STRETCH_HIGH);
    for (i = 0; i < STRETCH_RELAXATIONS; i++) {
        s->slow[i] = s->slow[i] + STRETCH_FLOAT(stretch_shares[i]) * (s->target - s->slow[i]);
    }
}

/* Keeps the target in its range. At an end of the range, the rate cannot lead outwards. */
STRETCH_INLINE void stretch_hold(stretch_state *s)
{
    int i;
    if (s->target < STRETCH_LOW) {
        s->target = STRETCH_LOW;
        s->rate = s->rate > 0.0f ? s->rate : 0.0f;
    }
    if (s->target > STRETCH_HIGH) {
        s->target = STRETCH_HIGH;
        s->rate = s->rate < 0.0f ? s->rate : 0.0f;
    }
    for (i = 0; i < STRETCH_PLAYS; i++) {
        s->plays[i] = stretch_play(s->plays[i], s->target, STRETCH_FLOAT(stretch_radii[i]));
    }
}

/* The index of the gains for a slope, by bisection. */
STRETCH_INLINE int stretch_nearest(float slope)
{
    int from = 0, to = STRETCH_SLOPES - 1;
    while (from < to) {
        const int middle = (from + to) / 2;
        if (slope < STRETCH_FLOAT(stretch_ends[middle])) {
            to = middle;
        } else {
            from = middle + 1;
        }
    }
    return from;
}

/* Corrects the states with a signed signal above its baseline. Returns whether it lay on the curve. */
STRETCH_INLINE int stretch_correct(stretch_state *s, float signal)
{
    const float first = STRETCH_FLOAT(stretch_curve[0]);
    const float last = STRETCH_FLOAT(stretch_curve[STRETCH_KNOTS - 1]);
    const float span = last - first;
    const float drive = stretch_drive(s, s->target) + STRETCH_LEAD_S * s->rate;
    const float *gains;
    float tangent, from, held, to, run, slope, surprise;
    int i;
    const float predicted = stretch_forward(drive, &tangent, &from);
    to = stretch_inverse(signal, &held);
    run = to - from;
    slope = tangent;
    /* the secant, if it is steeper; over a very short run it would consist of rounding errors */
    if ((run < 0.0f ? -run : run) > STRETCH_LEAST_RUN) {
        const float secant = (held - predicted) / run;
        slope = secant > tangent ? secant : tangent;
    }
    /* a spike is limited to one span of the curve beyond its ends */
    surprise = stretch_held(signal, first - span, last + span) - predicted;
    gains = stretch_gains[stretch_nearest(slope)];
    s->target = s->target + STRETCH_FLOAT(gains[0]) * surprise;
    s->rate = s->rate + STRETCH_FLOAT(gains[1]) * surprise;
    for (i = 0; i < STRETCH_RELAXATIONS; i++) {
        s->slow[i] = s->slow[i] + STRETCH_FLOAT(gains[2 + i]) * surprise;
    }
    stretch_hold(s);
    return !(held < signal || held > signal);
}

#if STRETCH_FOLLOWS_REST
/* Returns the signal above the baseline, and updates the baseline. */
STRETCH_INLINE float stretch_above_rest(stretch_state *s, float signal)
{
    float shift = 0.0f, tangent, at, excess, wanted, before;
    if (s->begun) {
        shift = stretch_forward(stretch_drive(s, STRETCH_LOW), &tangent, &at) - STRETCH_AT_REST;
    }
    excess = signal - s->baseline - (STRETCH_REST_LEVEL + shift);
    excess = stretch_held(excess, -STRETCH_REST_MOST, STRETCH_REST_MOST);
    s->excess = s->excess + STRETCH_REST_AVERAGE * (excess - s->excess);
    wanted = s->excess < 0.0f ? STRETCH_REST_PULL * s->excess : STRETCH_REST_LEAK;
    before = s->baseline;
    s->baseline = stretch_held(before + wanted, -STRETCH_REST_FURTHEST, STRETCH_REST_FURTHEST);
    s->excess = s->excess - (s->baseline - before);
    return signal - s->baseline;
}
#endif

static STRETCH_APART void stretch_begin(stretch_state *s, float signal)
{
    float held;
    const float target = stretch_held(stretch_inverse(signal, &held), STRETCH_LOW, STRETCH_HIGH);
    int i;
    s->target = target;
    s->rate = 0.0f;
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
        s->rate = 0.0f;
    }
    stretch_predict(s);
    stretch_hold(s);
}

/* Takes a missing sample. */
static STRETCH_APART stretch_reading stretch_lost(stretch_state *s)
{
    stretch_missed(s);
    return stretch_answer(STRETCH_MISSING, s->branch, STRETCH_INSIDE, 0.0f, 0.0f);
}

/* Takes a sample in the unit of the signal; NaN or STRETCH_NO_SIGNAL is a missing sample. */
static STRETCH_APART stretch_reading stretch_step(stretch_state *s, float sample)
{
    float signal;
    int on_curve;
    if (!stretch_usable(sample)) {
        return stretch_lost(s);
    }
    s->missing = 0;
    signal = STRETCH_SIGN * sample;
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
    return stretch_answer(STRETCH_OK, s->branch, on_curve ? STRETCH_INSIDE : STRETCH_SIGNAL_CLAMPED,
                          STRETCH_ZERO + STRETCH_GAIN * s->target, STRETCH_GAIN * s->rate);
}

