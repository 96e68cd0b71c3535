typedef struct stretch_sheet {
    int32_t centre;
    stretch_span signal;
    int32_t thousandths; /* 2^32 of these make a thousandth of a least bit */
    int32_t intercept;
    int32_t slope;
} stretch_sheet;

static const stretch_sheet stretch_sheets[1] = STRETCH_SHEETS;

STRETCH_INLINE int32_t stretch_estimate(const stretch_state *s, uint32_t sample, int32_t rate,
                                       uint8_t *outside)
{
    const stretch_sheet *sheet = &stretch_sheets[0];
    const int32_t volts =
        stretch_clamp(&sheet->signal, ((int32_t)sample - sheet->centre) * 32768,
                      STRETCH_SIGNAL_CLAMPED, outside);
    const uint64_t sum = stretch_sum((uint32_t)sheet->intercept, 0x7fffffffu, sheet->slope, volts);
    (void)s;
    (void)rate;
    return (int32_t)(stretch_product(stretch_high(sum), sheet->thousandths) >> 32);
}

