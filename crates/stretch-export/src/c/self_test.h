#define STRETCH_SELF_TEST @SAMPLES@

typedef struct stretch_sample {
    @FIELDS@
    uint8_t flags;
} stretch_sample;

/* ---- self-test ---- */

/* Runs the samples below. Returns 0 if every result equals the computer's bit for bit, otherwise the
 * number of the first sample with another result, counted from 1. */
static STRETCH_APART int stretch_self_test(void)
{
    static const stretch_sample samples[STRETCH_SELF_TEST] STRETCH_FLASH = {
@ROWS@
    };
    stretch_state state;
    int n;
    stretch_init(&state);
    for (n = 0; n < STRETCH_SELF_TEST; n++) {
        stretch_sample room;
        const stretch_sample *sample = STRETCH_LOADED(room, samples[n]);
        stretch_reading reading;
        uint8_t flags;
@if pressure
        stretch_set_pressure(&state, sample->pressure);
@end
        reading = stretch_step(&state, sample->@INPUT@);
        flags = (uint8_t)(reading.status | @FLAGS@);
        if (flags != sample->flags || @DIFFERS@) {
            return n + 1;
        }
    }
    return 0;
}
