#define STRETCH_SELF_TEST @SAMPLES@

typedef struct stretch_sample {
    @FIELDS@
    uint8_t flags;
} stretch_sample;

/* ---- self-test ---- */

/* Runs the samples below, 0 when every answer is the computer's, bit for bit; else the number of the
 * first that is not, from 1. */
static STRETCH_APART int stretch_self_test(void)
{
    static const stretch_sample samples[STRETCH_SELF_TEST] = {
@ROWS@
    };
    stretch_state state;
    int n;
    stretch_init(&state);
    for (n = 0; n < STRETCH_SELF_TEST; n++) {
        stretch_reading reading;
        uint8_t flags;
@if pressure
        stretch_set_pressure(&state, samples[n].pressure);
@end
        reading = stretch_step(&state, samples[n].@INPUT@);
        flags = (uint8_t)(reading.status | @FLAGS@);
        if (flags != samples[n].flags || @DIFFERS@) {
            return n + 1;
        }
    }
    return 0;
}
