/* ---- the rate: exact integers ---- */

typedef struct stretch_state {
    uint32_t sums[STRETCH_DEGREE + 1]; /* moments of the window, modulo 2^32 */
    int32_t last_rate;                 /* before a gap */
    uint32_t oldest;                   /* place of the oldest sample, or one past the end */
    uint32_t remaining;                /* samples until the window is full */
    uint16_t ring[STRETCH_WINDOW];
    uint16_t last; /* before a gap */
    uint8_t branch;
    uint8_t missing;
} stretch_state;

static inline void stretch_forget(stretch_state *s)
{
    uint16_t k;
    for (k = 0; k <= STRETCH_DEGREE; k++) {
        s->sums[k] = 0;
    }
    for (k = 0; k < STRETCH_WINDOW; k++) {
        s->ring[k] = 0;
    }
    s->last_rate = 0;
    s->last = 0;
    s->oldest = 0;
    s->remaining = STRETCH_WINDOW;
}

static inline void stretch_init(stretch_state *s)
{
    stretch_forget(s);
    s->branch = STRETCH_TARGET_RISES;
    s->missing = STRETCH_MAX_BRIDGED;
}

/* B_0 += x - old,  B_k += B_(k-1) - C(n, k) old; returns 1 if the window is full */
STRETCH_INLINE int stretch_slide(stretch_state *s, uint32_t sample)
{
    const uint32_t at = s->oldest < STRETCH_WINDOW ? s->oldest : 0u;
    const uint32_t old = s->ring[at];
    s->ring[at] = (uint16_t)sample;
    s->oldest = at + 1u;
#if STRETCH_DEGREE > 1
    s->sums[2] += s->sums[1] - STRETCH_CHOOSE_2 * old;
#endif
    s->sums[1] += s->sums[0] - STRETCH_CHOOSE_1 * old;
    s->sums[0] += sample - old;
    if (s->remaining > 0) {
        s->remaining--;
        return s->remaining == 0;
    }
    return 1;
}

/* (T_0 B_0 + T_1 B_1 + ..) / 2^shift */
STRETCH_INLINE int32_t stretch_rate(const stretch_state *s)
{
    int64_t total = STRETCH_HALF;
    total += stretch_product(STRETCH_WEIGHT_0, (int32_t)s->sums[0]);
    total += stretch_product(STRETCH_WEIGHT_1, (int32_t)s->sums[1]);
#if STRETCH_DEGREE > 1
    total += stretch_product(STRETCH_WEIGHT_2, (int32_t)s->sums[2]);
#endif
    return (int32_t)(total >> STRETCH_SHIFT);
}

static STRETCH_APART void stretch_missed(stretch_state *s)
{
    int64_t bridged;
    if (s->missing >= STRETCH_MAX_BRIDGED) {
        stretch_forget(s);
        return;
    }
    s->missing = (uint8_t)(s->missing + 1u);
    if (s->missing == 1) {
        s->last = s->ring[s->oldest > 0 ? s->oldest - 1u : STRETCH_WINDOW - 1u];
        s->last_rate = s->remaining == 0 ? stretch_rate(s) : 0;
    }
    /* the last sample, extrapolated with the last rate */
    bridged = ((int64_t)s->last_rate * STRETCH_CHANGE) >> (STRETCH_CHANGE_SHIFT - 9);
    bridged = (int64_t)s->last + ((bridged * s->missing + 256) >> 9);
    if (bridged < 0) {
        bridged = 0;
    }
    if (bridged > 65535) {
        bridged = 65535;
    }
    (void)stretch_slide(s, (uint32_t)bridged);
}

/* ---- the surface ---- */

typedef struct stretch_span {
    int32_t min;
    uint32_t width; /* from the lower end to the upper one */
    int32_t factor; /* scales the range to 32 bits */
} stretch_span;

/* The nearest value inside the range, scaled; *outside is set if the value was outside. */
STRETCH_INLINE int32_t stretch_clamp(const stretch_span *span, int32_t x, uint8_t flag,
                                    uint8_t *outside)
{
    /* one comparison: below the lower end the difference wraps to a large number */
    if ((uint32_t)x - (uint32_t)span->min > span->width) {
        x = x < span->min ? span->min : (int32_t)((uint32_t)span->min + span->width);
        *outside = (uint8_t)(*outside | flag);
    }
    return x * span->factor;
}

/* c and a fraction of 32 bits, plus a v / 2^32 */
STRETCH_INLINE uint64_t stretch_sum(uint32_t c, uint32_t fraction, int32_t a, int32_t v)
{
    return (((uint64_t)c << 32) | fraction) + (uint64_t)stretch_product(a, v);
}

STRETCH_INLINE int32_t stretch_high(uint64_t sum)
{
    return (int32_t)(uint32_t)(sum >> 32);
}

