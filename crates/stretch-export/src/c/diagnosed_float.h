
/* The only function from a library; every library rounds it correctly. */
#if defined(__GNUC__)
#define STRETCH_SQRT __builtin_sqrtf
#else
#include <math.h>
#define STRETCH_SQRT sqrtf
#endif

typedef struct stretch_state {
    float target;
    float rate;
    float yy, yr, rr; /* variance of the target, covariance, variance of the rate */
@if slip
    float slipped; /* by how much the muscle is ahead of its sleeve */
    float hidden;  /* variance of the target that the slip hides */
    float came;    /* how far the sleeve has moved in its last direction, in units of the signal */
    float shown;   /* the signal without memory, slightly smoothed */
@end
@if crosstalk
    float pressed; /* contribution of the pressure to the drive */
@end
@if hysteresis
    float plays[3];
@end
@if relaxation
    float fading[3]; /* contribution of each lag to the next drive */
@end
@if worn
    float travelled;
    float reached;
    float direction;
@end
@if rest
    float baseline;
    float excess;
@end
    uint8_t begun;
    uint8_t branch;
} stretch_state;

/* Resets all but branch, baseline, pressure and the distance that the gauge has travelled. */
static inline void stretch_forget(stretch_state *s)
{
@if slip
    s->hidden = 0.0f;
@end
    s->begun = 0;
}

static inline void stretch_init(stretch_state *s)
{
    stretch_forget(s);
    s->target = 0.0f;
    s->rate = 0.0f;
@if crosstalk
    s->pressed = 0.0f;
@end
@if worn
    s->travelled = STRETCH_WORN_TRAVELLED;
@end
@if rest
    s->baseline = 0.0f;
    s->excess = 0.0f;
@end
    s->branch = STRETCH_TARGET_RISES;
}

@if crosstalk
/* Sets the pressure for the following samples; NaN changes nothing. */
static inline void stretch_set_pressure(stretch_state *s, float pressure)
{
    if (stretch_usable(pressure)) {
        s->pressed = pressure * (STRETCH_PRESSED + STRETCH_PRESSED_TWICE * pressure);
    }
}

@end
/* x limited to low .. high; low if x is NaN */
STRETCH_INLINE float stretch_held(float x, float low, float high)
{
    x = x > low ? x : low;
    return x < high ? x : high;
}

@if knee
/* A lower bound with a rounded knee. */
STRETCH_INLINE float stretch_knee(float u, float at, float round)
{
    const float above = u - at;
    return at + 0.5f * (above + STRETCH_SQRT(above * above + round));
}

@end
@if slack
/* The strain of a sleeve that may go slack at a target. */
STRETCH_INLINE float stretch_taut(float u)
{
@if slack_low
    u = stretch_knee(u, STRETCH_SLACK_LOW, STRETCH_SLACK_LOW_ROUND);
@end
@if slack_high
    u = -stretch_knee(-u, STRETCH_SLACK_HIGH, STRETCH_SLACK_HIGH_ROUND);
@end
    return u;
}

@end
@if bounded
/* The output of an amplifier that saturates at a drive. */
STRETCH_INLINE float stretch_bounded(float u)
{
@if floor
    u = stretch_knee(u, STRETCH_FLOOR, STRETCH_FLOOR_ROUND);
@end
@if ceiling
    u = -stretch_knee(-u, STRETCH_CEILING, STRETCH_CEILING_ROUND);
@end
    return u;
}

@end
@if hysteresis
/* How far a play lags behind u. */
STRETCH_INLINE float stretch_apart(float at, float u, float radius)
{
    const float behind = u - at;
    const float size = behind < 0.0f ? -behind : behind;
    return size <= radius ? behind : behind > 0.0f ? radius : -radius;
}

/* The drive after the plays. */
STRETCH_INLINE float stretch_played(const stretch_state *s, float u)
{
    return u - STRETCH_PLAYED * (stretch_apart(s->plays[0], u, STRETCH_FLOAT(stretch_radii[0])) +
                                 stretch_apart(s->plays[1], u, STRETCH_FLOAT(stretch_radii[1])) +
                                 stretch_apart(s->plays[2], u, STRETCH_FLOAT(stretch_radii[2])));
}

@end
@if relaxation
/* Contribution of the past to the drive. */
STRETCH_INLINE float stretch_past(const stretch_state *s)
{
    return s->fading[0] + s->fading[1] + s->fading[2];
}

@end
@if worn
/* The drive after the loss of response by wear. */
STRETCH_INLINE float stretch_worn(const stretch_state *s, float u)
{
    const float left = 1.0f - STRETCH_WORN_M * s->travelled / (STRETCH_WORN_N + s->travelled);
    return STRETCH_WORN_ZERO + (u - STRETCH_WORN_ZERO) * left;
}

@end
@if worn
/* Adds to the distance travelled; turns that are smaller than a reversal do not count. */
STRETCH_INLINE void stretch_work(stretch_state *s, float u)
{
    const float moved = u - s->reached;
    const float size = moved < 0.0f ? -moved : moved;
    if (moved * s->direction > 0.0f || size > STRETCH_WORN_REVERSAL) {
        s->travelled = s->travelled + size;
        s->reached = u;
        s->direction = moved > 0.0f ? 1.0f : -1.0f;
    }
}

@end
@if initial_hysteresis
/* Initial hysteresis state of the plays: 1 as if the target had come up from far below. */
STRETCH_INLINE float stretch_initial_hysteresis(float y)
{
    return stretch_held(STRETCH_INITIAL_HYSTERESIS + STRETCH_INITIAL_HYSTERESIS_SLOPE * y, -1.0f, 1.0f);
}

@end
/* The drive at a target in this sample. */
STRETCH_INLINE float stretch_drive(const stretch_state *s, float y)
{
    float u = y;
    (void)s;
@if slack
    u = stretch_taut(u);
@end
@if crosstalk
    u = u + s->pressed;
@end
@if hysteresis
    u = stretch_played(s, u);
@end
@if relaxation
    u = STRETCH_OWN * u + stretch_past(s);
@end
@if worn
    u = stretch_worn(s, u);
@end
@if bounded
    u = stretch_bounded(u);
@end
    return u;
}

@if remembers
/* Updates the states of the defects with the target. */
STRETCH_INLINE void stretch_follow(stretch_state *s)
{
    float u = s->target;
@if hysteresis relaxation worn
    float input;
@end
@if hysteresis relaxation
    int i;
@end
@if slack
    u = stretch_taut(u);
@end
@if crosstalk
    u = u + s->pressed;
@end
@if hysteresis
    input = u;
    u = stretch_played(s, u);
    for (i = 0; i < 3; i++) {
        const float behind = input - s->plays[i];
        if ((behind < 0.0f ? -behind : behind) > STRETCH_FLOAT(stretch_radii[i])) {
            s->plays[i] =
                input - stretch_apart(s->plays[i], input, STRETCH_FLOAT(stretch_radii[i]));
        }
    }
@end
@if relaxation
    input = u;
    u = STRETCH_OWN * u + stretch_past(s);
    for (i = 0; i < 3; i++) {
        s->fading[i] = STRETCH_FLOAT(stretch_kept[i]) * s->fading[i] +
                       STRETCH_FLOAT(stretch_taken[i]) * input;
    }
@end
@if worn
    input = u;
    u = stretch_worn(s, u);
    stretch_work(s, input);
@end
@if bounded
    u = stretch_bounded(u);
@end
}

@end
/* The signal at a drive and the slope there; beyond an end, the last segment is extrapolated. */
STRETCH_INLINE float stretch_forward(float drive, float *slope)
{
    const float place = (drive - STRETCH_DRIVE_LOW) * STRETCH_PER_STEP;
    const int below = (int)stretch_held(place, 0.0f, (float)(STRETCH_KNOTS - 2));
    const float knot = STRETCH_FLOAT(stretch_curve[below]);
    const float rise = STRETCH_FLOAT(stretch_curve[below + 1]) - knot;
    *slope = rise * STRETCH_PER_STEP;
    return knot + (place - (float)below) * rise;
}

/* The drive at which the curve gives a signal; beyond an end, the last segment is extrapolated. */
STRETCH_INLINE float stretch_inverse(float signal)
{
    int below = 0, above = STRETCH_KNOTS - 1;
    float place, knot;
    while (above - below > 1) {
        const int middle = (below + above) / 2;
        if (STRETCH_FLOAT(stretch_curve[middle]) <= signal) {
            below = middle;
        } else {
            above = middle;
        }
    }
    knot = STRETCH_FLOAT(stretch_curve[below]);
    place = (float)below + (signal - knot) / (STRETCH_FLOAT(stretch_curve[below + 1]) - knot);
    return STRETCH_DRIVE_LOW + place * STRETCH_DRIVE_STEP;
}

/* Sets the states of the defects to those after the target has rested at y. */
STRETCH_INLINE void stretch_settle(stretch_state *s, float y)
{
@if remembers
    float u = y;
@if hysteresis
    const float initial = stretch_initial_hysteresis(y);
@end
@if hysteresis relaxation
    int i;
@end
@if slack
    u = stretch_taut(u);
@end
@if crosstalk
    u = u + s->pressed;
@end
@if hysteresis
    for (i = 0; i < 3; i++) {
        s->plays[i] = u - initial * STRETCH_FLOAT(stretch_radii[i]);
    }
    u = stretch_played(s, u);
@end
@if relaxation
    for (i = 0; i < 3; i++) {
        s->fading[i] = STRETCH_FLOAT(stretch_settled[i]) * u;
    }
@end
@if worn
    s->travelled = STRETCH_WORN_TRAVELLED;
    s->reached = u;
    s->direction = 0.0f;
    u = stretch_worn(s, u);
@end
@if bounded
    u = stretch_bounded(u);
@end
@end
    (void)s;
    (void)y;
}

/* Starts at the target that would rest at a signal. */
static STRETCH_APART void stretch_begin(stretch_state *s, float signal)
{
    const float to = stretch_inverse(signal);
    float target = stretch_held(to, STRETCH_LOW, STRETCH_HIGH);
    int k;
@if slip
    float slope;
@end
@if worn
    const float travelled = s->travelled;
@end
    /* plays offset the drive by a constant; the repetitions handle the knees */
    for (k = 0; k < 3; k++) {
        stretch_settle(s, target);
        target = stretch_held(target + (to - stretch_drive(s, target)), STRETCH_LOW, STRETCH_HIGH);
    }
    stretch_settle(s, target);
@if worn
    s->travelled = travelled;
@end
    s->target = target;
    s->rate = 0.0f;
@if slip
    s->slipped = STRETCH_SLIP * stretch_initial_hysteresis(target);
    s->shown = stretch_forward(target, &slope);
    s->came = s->shown;
@end
    s->yy = STRETCH_BEGIN_YY;
    s->yr = 0.0f;
    s->rr = STRETCH_BEGIN_RR;
    s->begun = 1;
}

/* Keeps the target in its range. At an end of the range, the rate cannot lead outwards. */
STRETCH_INLINE void stretch_hold(stretch_state *s)
{
    if (s->target < STRETCH_LOW) {
        s->target = STRETCH_LOW;
        s->rate = s->rate > 0.0f ? s->rate : 0.0f;
    }
    if (s->target > STRETCH_HIGH) {
        s->target = STRETCH_HIGH;
        s->rate = s->rate < 0.0f ? s->rate : 0.0f;
    }
}

/* Advances target, rate and covariance by one sample. */
STRETCH_INLINE void stretch_predict(stretch_state *s)
{
    float across = s->yr + STRETCH_PERIOD_S * s->rr;
    float grown = s->yy + STRETCH_PERIOD_S * (s->yr + across);
    s->target = s->target + STRETCH_PERIOD_S * s->rate;
    s->rate = STRETCH_KEPT * s->rate;
    across = STRETCH_KEPT * across;
    /* an unlimited variance would move the target from end to end of a flat part of the curve */
    if (grown > STRETCH_WIDEST) {
        const float share = STRETCH_WIDEST / grown;
        grown = share * grown;
        across = share * across;
    }
    s->yy = grown;
    s->yr = across;
    s->rr = STRETCH_KEPT_TWICE * s->rr + STRETCH_PROCESS_NOISE;
    stretch_hold(s);
}

@if slip
/* The muscle is ahead of its sleeve in the direction of the last movement; at rest, it is anywhere in the slip. */
STRETCH_INLINE void stretch_turn(stretch_state *s)
{
    const float toward = s->slipped < 0.0f ? -1.0f : 1.0f;
    const float back = toward * (s->came - s->shown);
    if (back <= 0.0f) {
        s->came = s->shown;
        s->slipped = toward * STRETCH_SLIP;
        s->hidden = 0.0f;
    } else if (back > STRETCH_TURN_THRESHOLD) {
        s->came = s->shown;
        s->slipped = -toward * STRETCH_SLIP;
        s->hidden = 0.0f;
    } else {
        s->came = s->came + STRETCH_SLIP_VARIANCE_SHARE * (s->shown - s->came);
        s->hidden = s->hidden + STRETCH_SLIP_VARIANCE_SHARE * (STRETCH_SLIP_VARIANCE - s->hidden);
    }
}

@end
/* Corrects the states with a signed signal above its baseline. Returns whether it lay on the curve. */
STRETCH_INLINE int stretch_correct(stretch_state *s, float signal)
{
    const float first = STRETCH_FLOAT(stretch_curve[0]);
    const float last = STRETCH_FLOAT(stretch_curve[STRETCH_KNOTS - 1]);
    const float span = last - first;
    const float here = s->target;
    const float drive = stretch_drive(s, here);
    float tangent;
    const float predicted = stretch_forward(drive, &tangent);
    /* a spike is limited to one span of the curve beyond its ends */
    const float input = stretch_held(signal, first - span, last + span);
    const int on_curve = input >= first && input <= last;
    const float run = stretch_inverse(input) - drive, surprise = input - predicted;
    const int far = (run < 0.0f ? -run : run) > STRETCH_LEAST_RUN;
    /* the slope of the drive, as a secant to the target that would explain the signal */
    const float probe = far ? run : run < 0.0f ? -STRETCH_LEAST_RUN : STRETCH_LEAST_RUN;
    const float asked = (stretch_drive(s, here + probe) - drive) / probe;
    const float answer = asked > STRETCH_LEAST_ANSWER ? asked : STRETCH_LEAST_ANSWER;
    /* the slope of the curve: the steeper of secant and tangent, so that a flat end cannot move the estimate too far */
    const float secant = far ? surprise / run : tangent;
    const float slope = answer * (secant > tangent ? secant : tangent);
    const float by_y = slope * s->yy, by_r = slope * s->yr;
    const float share = 1.0f / (slope * by_y + STRETCH_NOISE);
    const float gain_y = by_y * share, gain_r = by_r * share;
    s->target = here + gain_y * surprise;
    s->rate = s->rate + gain_r * surprise;
    s->yy = s->yy - gain_y * by_y;
    s->yr = s->yr - gain_y * by_r;
    s->rr = s->rr - gain_r * by_r;
    stretch_hold(s);
@if slip
    {
        /* the signal that a gauge without memory would have */
        const float shown = stretch_forward(here, &tangent) + surprise;
        s->shown = s->shown + STRETCH_SMOOTH * (shown - s->shown);
        stretch_turn(s);
    }
@end
@if remembers
    stretch_follow(s);
@end
    return on_curve;
}

@if rest
/* Returns the signal above the baseline, and updates the baseline. */
STRETCH_INLINE float stretch_above_rest(stretch_state *s, float signal)
{
    float shift = 0.0f, slope, excess, wanted, before;
    if (s->begun) {
        shift = stretch_forward(stretch_drive(s, STRETCH_LOW), &slope) - STRETCH_AT_REST;
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

@end
static STRETCH_APART void stretch_missed(stretch_state *s)
{
    if (!s->begun) {
        return;
    }
    stretch_predict(s);
@if remembers
    stretch_follow(s);
@end
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
    stretch_reading reading;
    float signal, target, variance;
    uint8_t domain;
    if (!stretch_usable(sample)) {
        return stretch_lost(s);
    }
    signal = STRETCH_SIGN * sample;
@if rest
    signal = stretch_above_rest(s, signal);
@end
    if (s->begun) {
        stretch_predict(s);
    } else {
        stretch_begin(s, signal);
    }
    domain = stretch_correct(s, signal) ? STRETCH_INSIDE : STRETCH_SIGNAL_CLAMPED;
    if (s->rate > STRETCH_DEAD_BAND) {
        s->branch = STRETCH_TARGET_RISES;
    } else if (s->rate < -STRETCH_DEAD_BAND) {
        s->branch = STRETCH_TARGET_FALLS;
    }
    target = s->target;
    variance = s->yy;
@if slip
    target = target + s->slipped;
    variance = s->hidden + variance;
@end
@if skew
    target = target + STRETCH_AHEAD_S * s->rate;
    variance = variance + STRETCH_AHEAD_S * (s->yr + s->yr + STRETCH_AHEAD_S * s->rr);
@end
    target = stretch_held(target, STRETCH_LOW, STRETCH_HIGH);
    reading = stretch_answer(STRETCH_OK, s->branch, domain, STRETCH_ZERO + STRETCH_GAIN * target,
                             STRETCH_GAIN * s->rate);
    reading.sd = STRETCH_SPREAD * STRETCH_SQRT(variance > 0.0f ? variance : 0.0f);
    /* the numbers have overflowed: the next sample restarts the filter */
    s->begun = stretch_usable(s->target) ? 1 : 0;
    return reading;
}
