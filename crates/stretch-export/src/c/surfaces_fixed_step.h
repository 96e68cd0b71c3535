/* ---- a sample in, a reading out ---- */

/* Takes a missing sample. */
static inline stretch_reading stretch_lost(stretch_state *s)
{
    stretch_missed(s);
    return stretch_answer(STRETCH_MISSING, s->branch, STRETCH_INSIDE, 0);
}

/* Takes a code of the converter; any other number is a missing sample. */
static inline stretch_reading stretch_step(stretch_state *s, int32_t code)
{
    const uint32_t band = STRETCH_DEAD_BAND;
    uint8_t outside = STRETCH_INSIDE;
    uint32_t sample;
    int32_t rate, estimate;
    if ((uint32_t)code >= STRETCH_CODES) {
        return stretch_lost(s);
    }
    sample = (uint32_t)code * STRETCH_ALIGN;
    s->missing = 0;
@if static
    /* the estimate needs no rate, which is 0 until the window is full */
    rate = stretch_slide(s, sample) ? stretch_rate(s) : 0;
@end
@if moving
    if (!stretch_slide(s, sample)) {
        return stretch_answer(STRETCH_WARMING, s->branch, STRETCH_INSIDE, 0);
    }
    rate = stretch_rate(s);
@end
    /* outside the dead band (one comparison), the branch is the sign of the target's rate */
    if ((uint32_t)rate + band > 2u * band) {
        s->branch = (uint8_t)(((uint32_t)rate ^ STRETCH_MIRROR) >> 31);
    }
    estimate = stretch_at(s, sample, rate, &outside);
    return stretch_answer(STRETCH_OK, s->branch, outside, estimate);
}

