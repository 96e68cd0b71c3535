/* ---- the rate ---- */

typedef struct stretch_state {
    float sums[STRETCH_WINDOW]; /* contributions of the samples so far to the following rates */
    float last;
    float last_rate;
    uint16_t remaining;
    uint8_t branch;
    uint8_t missing;
} stretch_state;

static inline void stretch_forget(stretch_state *s)
{
    int k;
    for (k = 0; k < STRETCH_WINDOW; k++) {
        s->sums[k] = 0.0f;
    }
    s->last = 0.0f;
    s->last_rate = 0.0f;
    s->remaining = STRETCH_WINDOW - 1;
}

static inline void stretch_init(stretch_state *s)
{
    stretch_forget(s);
    s->branch = STRETCH_TARGET_RISES;
    s->missing = STRETCH_MAX_BRIDGED;
}

/* The transposed filter. Returns 1, and the rate in *rate, if the window is full. */
STRETCH_INLINE int stretch_rate(stretch_state *s, float x, float *rate)
{
    int j;
    *rate = s->sums[0] + STRETCH_FLOAT(stretch_taps[0]) * x;
    for (j = 1; j < STRETCH_WINDOW; j++) {
        s->sums[j - 1] = s->sums[j] + STRETCH_FLOAT(stretch_taps[j]) * x;
    }
    if (s->remaining > 0) {
        s->remaining = (uint16_t)(s->remaining - 1u);
        return 0;
    }
    return 1;
}

static STRETCH_APART void stretch_missed(stretch_state *s)
{
    if (s->missing < STRETCH_MAX_BRIDGED) {
        /* the last sample, extrapolated with the last rate */
        const float bridged = s->last + s->last_rate * STRETCH_PERIOD_S;
        s->missing = (uint8_t)(s->missing + 1u);
        if (bridged >= -FLT_MAX && bridged <= FLT_MAX) {
            float rate;
            s->last = bridged;
            if (stretch_usable(bridged)) {
                (void)stretch_rate(s, bridged, &rate);
            }
            return;
        }
    }
    stretch_forget(s);
    s->missing = STRETCH_MAX_BRIDGED;
}

/* ---- the surface ---- */

/* The nearest value inside the range; *outside is set if the value was outside. */
STRETCH_INLINE float stretch_clamp(float x, float min, float max, uint8_t flag, uint8_t *outside)
{
    if (x < min) {
        *outside = (uint8_t)(*outside | flag);
        return min;
    }
    if (x > max) {
        *outside = (uint8_t)(*outside | flag);
        return max;
    }
    return x;
}

