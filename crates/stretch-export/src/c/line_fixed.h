typedef struct stretch_surface {
    int32_t centre;
    stretch_span signal;
    int32_t thousandths; /* thousandths of the unit per least bit of the sum, times 2^32 */
    int32_t intercept;
    int32_t slope;
} stretch_surface;

STRETCH_INLINE int32_t stretch_estimate(const stretch_surface *surface, uint32_t sample, int32_t rate,
                                       uint8_t *outside)
{
    const int32_t signal =
        stretch_clamp(&surface->signal, ((int32_t)sample - surface->centre) * 32768,
                      STRETCH_SIGNAL_CLAMPED, outside);
    const uint64_t sum = stretch_sum((uint32_t)surface->intercept, 0x7fffffffu, surface->slope, signal);
    (void)rate;
    return (int32_t)(stretch_product(stretch_high(sum), surface->thousandths) >> 32);
}

