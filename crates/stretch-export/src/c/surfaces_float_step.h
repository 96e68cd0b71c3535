/* ---- a sample in, a reading out ---- */

/* Takes a missing sample. */
static STRETCH_APART stretch_reading stretch_lost(stretch_state *s)
{
    stretch_missed(s);
    return stretch_answer(STRETCH_MISSING, s->branch, STRETCH_INSIDE, 0.0f, 0.0f);
}

/* Takes a sample in the unit of the signal; NaN or STRETCH_NO_VOLTS is a missing sample. */
static STRETCH_APART stretch_reading stretch_step(stretch_state *s, float volts)
{
    uint8_t outside = STRETCH_INSIDE;
    float rate, slope, estimate;
    if (!stretch_usable(volts)) {
        return stretch_lost(s);
    }
    s->missing = 0;
    s->last = volts;
@if static
    /* the estimate needs no rate, which is 0 until the window is full */
    if (!stretch_rate(s, volts, &rate)) {
        rate = 0.0f;
    }
@end
@if moving
    if (!stretch_rate(s, volts, &rate)) {
        return stretch_answer(STRETCH_WARMING, s->branch, STRETCH_INSIDE, 0.0f, 0.0f);
    }
@end
    s->last_rate = rate;
    if (rate > STRETCH_DEAD_BAND) {
        s->branch = STRETCH_RISING;
    } else if (rate < -STRETCH_DEAD_BAND) {
        s->branch = STRETCH_FALLING;
    }
    estimate = stretch_estimate(s, volts, rate, &slope, &outside);
    return stretch_answer(STRETCH_OK, s->branch, outside, estimate, slope * rate);
}

