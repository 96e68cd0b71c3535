/* ---- a sample in, a reading out ---- */

/* Takes a missing sample. */
static STRETCH_APART stretch_reading stretch_lost(stretch_state *s)
{
    stretch_missed(s);
    return stretch_answer(STRETCH_MISSING, s->branch, STRETCH_INSIDE, 0.0f, 0.0f);
}

/* Takes a sample in the unit of the signal; NaN or STRETCH_NO_SIGNAL is a missing sample. */
static STRETCH_APART stretch_reading stretch_step(stretch_state *s, float sample)
{
    uint8_t outside = STRETCH_INSIDE;
    float rate, slope, estimate;
    if (!stretch_usable(sample)) {
        return stretch_lost(s);
    }
    s->missing = 0;
    s->last = sample;
@if static
    /* the estimate needs no rate, which is 0 until the window is full */
    if (!stretch_rate(s, sample, &rate)) {
        rate = 0.0f;
    }
@end
@if moving
    if (!stretch_rate(s, sample, &rate)) {
        return stretch_answer(STRETCH_WARMING, s->branch, STRETCH_INSIDE, 0.0f, 0.0f);
    }
@end
    s->last_rate = rate;
    if (rate > STRETCH_DEAD_BAND) {
        s->branch = STRETCH_SIGNAL_RISES;
    } else if (rate < -STRETCH_DEAD_BAND) {
        s->branch = STRETCH_SIGNAL_FALLS;
    }
    estimate = stretch_estimate(s, sample, rate, &slope, &outside);
    return stretch_answer(STRETCH_OK, s->branch, outside, estimate, slope * rate);
}

