typedef struct stretch_reading {
    float estimate; /* in STRETCH_UNIT */
    float rate;     /* of the estimate, per second */
@if sd
    float sd;       /* standard deviation of the estimate */
@end
    uint8_t status;
    uint8_t branch;
    uint8_t domain;
} stretch_reading;

STRETCH_INLINE stretch_reading stretch_answer(uint8_t status, uint8_t branch, uint8_t domain,
                                             float estimate, float rate)
{
    stretch_reading reading;
    reading.estimate = estimate;
    reading.rate = rate;
@if sd
    reading.sd = 0.0f;
@end
    reading.status = status;
    reading.branch = branch;
    reading.domain = domain;
    return reading;
}

