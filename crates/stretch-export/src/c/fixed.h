/* Instead of a code: a missing sample, like any other number that is not a code. */
#define STRETCH_NO_CODE (-1)

/* The first code, 0, and the last code also come from a loose wire or from a signal beyond the
 * converter. Call stretch_lost for them, unless the calibrated range reaches them. On a noisy
 * supply, call it for every code below STRETCH_LOWEST_CODE or above STRETCH_HIGHEST_CODE. */
#define STRETCH_LAST_CODE ((1L << STRETCH_ADC_BITS) - 1)

/* Shifts of negative numbers must keep the sign, as on every known compiler for a board. */
typedef char stretch_shifts_keep_signs[(-1 >> 1) == -1 ? 1 : -1];

typedef struct stretch_reading {
    int32_t estimate; /* thousandths of STRETCH_UNIT */
    uint8_t status;
    uint8_t branch;
    uint8_t domain;
} stretch_reading;

STRETCH_INLINE stretch_reading stretch_answer(uint8_t status, uint8_t branch, uint8_t domain,
                                             int32_t estimate)
{
    stretch_reading reading;
    reading.estimate = estimate;
    reading.status = status;
    reading.branch = branch;
    reading.domain = domain;
    return reading;
}

/* a b, in 64 bits */
STRETCH_INLINE int64_t stretch_product(int32_t a, int32_t b)
{
    return (int64_t)a * (int64_t)b;
}

