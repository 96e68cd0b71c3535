typedef struct stretch_surface {
    int32_t centre;
    stretch_span signal;
    stretch_span rate;
    int32_t thousandths; /* thousandths of the unit per least bit of the sum, times 2^32 */
    int32_t p[7];        /* p11 p12 p10 p00 p02 p03 p01, in the order of use */
} stretch_surface;

/* Horner's rule; the fraction of each product is carried into the next. */
STRETCH_INLINE int32_t stretch_estimate(const stretch_surface *surface, uint32_t sample, int32_t rate,
                                       uint8_t *outside)
{
    const int32_t *p = surface->p;
    const int32_t signal =
        stretch_clamp(&surface->signal, ((int32_t)sample - surface->centre) * 32768,
                      STRETCH_SIGNAL_CLAMPED, outside);
    const int32_t r = stretch_clamp(&surface->rate, rate, STRETCH_RATE_CLAMPED, outside);
    uint64_t sum, moving;
    sum = stretch_sum((uint32_t)p[0], 0x7fffffffu, p[1], signal);
    sum = stretch_sum((uint32_t)p[2], (uint32_t)sum, stretch_high(sum), signal);
    moving = stretch_sum((uint32_t)p[3], (uint32_t)sum, stretch_high(sum), r);
    sum = stretch_sum((uint32_t)p[4], (uint32_t)moving, p[5], signal);
    sum = stretch_sum((uint32_t)p[6], (uint32_t)sum, stretch_high(sum), signal);
    sum = stretch_sum((uint32_t)(moving >> 32), (uint32_t)sum, stretch_high(sum), signal);
    return (int32_t)(stretch_product(stretch_high(sum), surface->thousandths) >> 32);
}

