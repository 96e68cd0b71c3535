typedef struct stretch_surface {
    float signal_min, signal_max, rate_min, rate_max;
    float offset, rate_offset;
    float p00, p10, p01, p11, p02, p12, p03;
} stretch_surface;

static const stretch_surface stretch_surfaces[2] STRETCH_FLASH = STRETCH_SURFACES;

/* The estimate; *slope is its derivative with respect to the signal. */
STRETCH_INLINE float stretch_estimate(const stretch_state *s, float x, float rate, float *slope,
                                     uint8_t *outside)
{
    stretch_surface room;
    const stretch_surface *p = STRETCH_LOADED(room, stretch_surfaces[s->branch]);
    const float v =
        stretch_clamp(x, p->signal_min, p->signal_max, STRETCH_SIGNAL_CLAMPED, outside) - p->offset;
    const float r =
        stretch_clamp(rate, p->rate_min, p->rate_max, STRETCH_RATE_CLAMPED, outside) -
        p->rate_offset;
    const float at_rest = ((p->p03 * v + p->p02) * v + p->p01) * v + p->p00;
    const float by_rate = (p->p12 * v + p->p11) * v + p->p10;
    *slope = (3.0f * p->p03 * v + 2.0f * (p->p02 + p->p12 * r)) * v + p->p01 + p->p11 * r;
    return at_rest + r * by_rate;
}

