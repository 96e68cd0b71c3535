
/* The estimate; *slope is its derivative with respect to the signal. */
STRETCH_INLINE float stretch_estimate(const stretch_state *s, float x, float rate, float *slope,
                                     uint8_t *outside)
{
    const float v =
        stretch_clamp(x, STRETCH_SIGNAL_MIN, STRETCH_SIGNAL_MAX, STRETCH_SIGNAL_CLAMPED, outside) -
        STRETCH_OFFSET;
    float estimate = 0.0f;
    int j;
    (void)s;
    (void)stretch_clamp(rate, STRETCH_RATE_MIN, STRETCH_RATE_MAX, STRETCH_RATE_CLAMPED, outside);
    *slope = 0.0f;
    for (j = STRETCH_DEGREE; j > 0; j--) {
        estimate = estimate * v + STRETCH_FLOAT(stretch_curve[j]);
        *slope = *slope * v + (float)j * STRETCH_FLOAT(stretch_curve[j]);
    }
    return estimate * v + STRETCH_FLOAT(stretch_curve[0]);
}
