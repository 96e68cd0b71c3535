/* Prints the reading for every row of standard input: one sample per gauge (32 bits in hexadecimal), or r and the number
 * of a gauge that is used again. */
#include "stretch.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static unsigned long bits_of(float number)
{
    uint32_t bits;
    memcpy(&bits, &number, sizeof bits);
    return bits;
}

int main(void)
{
    char word[16];
    stretch_state state;
#ifdef STRETCH_SHIFT_SAMPLES
    stretch_shifts_state blocks;
    stretch_shifts told;
#endif
    const int wrong = stretch_self_test();
    if (wrong != 0) {
        printf("the self-test fails at sample %d\n", wrong);
        return 1;
    }
    stretch_init(&state);
#ifdef STRETCH_SHIFT_SAMPLES
    stretch_shifts_init(&blocks);
#endif
    while (scanf("%15s", word) == 1) {
        float volts[STRETCH_CHANNELS];
        stretch_reading reading;
        int k;
        if (word[0] == 'r') {
            stretch_readmit(&state, atoi(word + 1));
            continue;
        }
        for (k = 0; k < STRETCH_CHANNELS; k++) {
            const uint32_t bits = (uint32_t)strtoul(word, NULL, 16);
            memcpy(&volts[k], &bits, sizeof bits);
            if (k + 1 < STRETCH_CHANNELS && scanf("%15s", word) != 1) {
                return 1;
            }
        }
        reading = stretch_step(&state, volts);
        printf("%u %u %u %08lx %08lx", (unsigned)reading.status, (unsigned)reading.lost,
               (unsigned)reading.clamped, bits_of(reading.estimate), bits_of(reading.sd));
        for (k = 0; k < STRETCH_CHANNELS; k++) {
            printf(" %u", (unsigned)stretch_loss(&state, k));
        }
#ifdef STRETCH_SHIFT_SAMPLES
        if (stretch_shifts_step(&blocks, &state, &told)) {
            printf(" shifts %u", (unsigned)told.shifted);
            for (k = 0; k < STRETCH_CHANNELS; k++) {
                printf(" %08lx", bits_of(told.off[k]));
            }
        }
#endif
        printf("\n");
    }
    return 0;
}
