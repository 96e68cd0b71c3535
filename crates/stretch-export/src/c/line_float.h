/* The estimate; *slope is its derivative with respect to the signal. */
STRETCH_INLINE float stretch_estimate(const stretch_state *s, float x, float rate, float *slope,
                                     uint8_t *outside)
{
    const float inside =
        stretch_clamp(x, STRETCH_SIGNAL_MIN, STRETCH_SIGNAL_MAX, STRETCH_SIGNAL_CLAMPED, outside);
    (void)s;
    (void)rate;
    *slope = STRETCH_SLOPE;
    return STRETCH_INTERCEPT + STRETCH_SLOPE * (inside - STRETCH_OFFSET);
}

