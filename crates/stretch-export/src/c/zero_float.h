
/* ---- whether the zero is still that of the calibration ---- */

/* A separate state: stretch_zero_init(&zero, 1) follows a slow change of zero, stretch_zero_init(&zero, 0) does not.
 * Then in every period
 *     if (stretch_zero_step(&zero, sample, &result)) { a movement has ended: read result }
 *     reading = stretch_step(&state, stretch_zero_corrected(&zero, sample));
 */
typedef struct stretch_zero_state {
    float before[2];
    float extreme;
    float low;
    float levels[STRETCH_ZERO_LEVELS];
    float base;
    float follow;
    float followed;
    uint32_t samples;
    uint32_t end;
    uint32_t first;
    uint32_t since;
    uint8_t seen;
    uint8_t rises;
    uint8_t has_low;
    uint8_t held;
    uint8_t shifted;
} stretch_zero_state;

/* Result of a movement: the state of the zero. */
typedef struct stretch_zero {
    float off;              /* difference from the zero of the calibration, in the signal's unit */
    float off_reference;    /* the same as a change of the estimate, in STRETCH_UNIT */
    float followed;         /* the part of it that is followed, in the signal's unit */
    uint32_t since_samples; /* samples since the first movement after the pause with the shift */
    uint8_t shifted;        /* whether the zero has shifted across a pause */
} stretch_zero;

static inline void stretch_zero_init(stretch_zero_state *z, int follow)
{
    int k;
    for (k = 0; k < STRETCH_ZERO_LEVELS; k++) {
        z->levels[k] = 0.0f;
    }
    z->before[0] = 0.0f;
    z->before[1] = 0.0f;
    z->extreme = 0.0f;
    z->low = 0.0f;
    z->base = STRETCH_ZERO_LEVEL;
    z->follow = follow ? STRETCH_ZERO_FOLLOW : 0.0f;
    z->followed = 0.0f;
    z->samples = 0u;
    z->end = 0u;
    z->first = 0u;
    z->since = 0u;
    z->seen = 0u;
    z->rises = 1u;
    z->has_low = 0u;
    z->held = 0u;
    z->shifted = 0u;
}

STRETCH_INLINE float stretch_less(float a, float b)
{
    return a < b ? a : b;
}

STRETCH_INLINE float stretch_more(float a, float b)
{
    return a > b ? a : b;
}

STRETCH_INLINE float stretch_within(float x, float most)
{
    return stretch_less(stretch_more(x, -most), most);
}

/* Returns 1 at the end of a movement, and its level in *level. */
STRETCH_INLINE int stretch_zero_turn(stretch_zero_state *z, float x, float *level)
{
    const float first = z->before[0], second = z->before[1];
    const float middle =
        stretch_more(stretch_less(first, second), stretch_less(stretch_more(first, second), x));
    z->before[0] = second;
    z->before[1] = x;
    if (z->seen < 2u) {
        z->seen = (uint8_t)(z->seen + 1u);
        return 0;
    }
    if (z->seen == 2u) {
        z->seen = 3u;
        z->extreme = middle;
    }
    if (z->rises) {
        z->extreme = stretch_more(z->extreme, middle);
        if (middle < z->extreme - STRETCH_ZERO_SPAN) {
            *level = STRETCH_ZERO_LOW_SHARE * z->low + STRETCH_ZERO_HIGH_SHARE * z->extreme;
            z->rises = 0u;
            z->extreme = middle;
            return z->has_low;
        }
    } else {
        z->extreme = stretch_less(z->extreme, middle);
        if (middle > z->extreme + STRETCH_ZERO_SPAN) {
            z->low = z->extreme;
            z->has_low = 1u;
            z->rises = 1u;
            z->extreme = middle;
        }
    }
    return 0;
}

/* The median of the last levels. */
STRETCH_INLINE float stretch_zero_median(const stretch_zero_state *z)
{
    float sorted[STRETCH_ZERO_LEVELS];
    int i, k;
    for (i = 0; i < STRETCH_ZERO_LEVELS; i++) {
        const float level = z->levels[i];
        for (k = i; k > 0 && level < sorted[k - 1]; k--) {
            sorted[k] = sorted[k - 1];
        }
        sorted[k] = level;
    }
    return sorted[STRETCH_ZERO_LEVELS / 2];
}

/* Whether a level differs from another one by more than is usual. */
STRETCH_INLINE int stretch_zero_beyond(float level, float from)
{
    return level - from > STRETCH_ZERO_LIMIT || level - from < -STRETCH_ZERO_LIMIT;
}

/* Compares the levels after a pause with those before it. */
STRETCH_INLINE void stretch_zero_compare(stretch_zero_state *z)
{
    const float middle = stretch_zero_median(z);
    if (z->shifted) {
        z->shifted = stretch_zero_beyond(middle, STRETCH_ZERO_LEVEL) ? 1u : 0u;
    } else if (stretch_zero_beyond(middle, z->base)) {
        z->shifted = 1u;
        z->since = z->first;
    }
}

/* A sample minus the followed zero. Pass the result to stretch_step. */
static inline float stretch_zero_corrected(const stretch_zero_state *z, float sample)
{
    return sample - STRETCH_ZERO_SIGN * z->followed;
}

/* Takes a sample in the unit of the signal. Returns 1 if a movement has ended, from the fifth after a pause on. */
static STRETCH_APART int stretch_zero_step(stretch_zero_state *z, float sample, stretch_zero *told)
{
    float level = 0.0f, off, clipped;
    int k;
    z->samples += 1u;
    if (!stretch_usable(sample) || !stretch_zero_turn(z, STRETCH_ZERO_SIGN * sample, &level)) {
        return 0;
    }
    if (z->samples - z->end > STRETCH_ZERO_PAUSE) {
        if (z->held == STRETCH_ZERO_LEVELS) {
            z->base = stretch_zero_median(z);
        }
        z->held = 0u;
    }
    z->end = z->samples;
    if (z->held == 0u) {
        z->first = z->samples;
    }
    for (k = 1; k < STRETCH_ZERO_LEVELS; k++) {
        z->levels[k - 1] = z->levels[k];
    }
    z->levels[STRETCH_ZERO_LEVELS - 1] = level;
    clipped = stretch_within(level - STRETCH_ZERO_LEVEL - z->followed, STRETCH_ZERO_MOST);
    z->followed = stretch_within(z->followed + z->follow * clipped, STRETCH_ZERO_LIMIT);
    /* the levels are compared once after each pause */
    if (z->held < STRETCH_ZERO_LEVELS) {
        z->held = (uint8_t)(z->held + 1u);
        if (z->held < STRETCH_ZERO_LEVELS) {
            return 0;
        }
        stretch_zero_compare(z);
    }
    off = stretch_zero_median(z) - STRETCH_ZERO_LEVEL;
    told->off = STRETCH_ZERO_SIGN * off;
    told->off_reference = STRETCH_ZERO_REFERENCE * off;
    told->followed = STRETCH_ZERO_SIGN * z->followed;
    told->since_samples = z->shifted ? z->samples - z->since : 0u;
    told->shifted = z->shifted;
    return 1;
}
