/* Prints the reading for every sample from standard input (32 bits in hexadecimal; x is a missing sample). If the header
 * takes a pressure, the pressure comes before each sample. If the header can load a calibration, the input may also be
 * "load", the bytes of a binary calibration file and a dot; the result of loading is then printed. */
#include "stretch.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint32_t bits_of(const void *number)
{
    uint32_t bits;
    memcpy(&bits, number, sizeof bits);
    return bits;
}

int main(void)
{
    char word[16];
    stretch_state state;
#ifdef STRETCH_ZERO_LEVEL
    stretch_zero_state zero;
#endif
    const int wrong = stretch_self_test();
    if (wrong != 0) {
        printf("the self-test fails at sample %d\n", wrong);
        return 1;
    }
    stretch_init(&state);
#ifdef STRETCH_ZERO_LEVEL
    stretch_zero_init(&zero, 1);
#endif
    while (scanf("%15s", word) == 1) {
        uint32_t bits = (uint32_t)strtoul(word, NULL, 16);
        stretch_reading reading;
        uint32_t rate = 0, sd = 0;
#ifdef STRETCH_CAN_LOAD
        if (strcmp(word, "load") == 0) {
            uint8_t record[600];
            size_t size = 0;
            while (scanf("%15s", word) == 1 && word[0] != '.' && size < sizeof record) {
                record[size++] = (uint8_t)strtoul(word, NULL, 16);
            }
            printf("load %u\n", (unsigned)stretch_load(record, size));
            stretch_init(&state);
            continue;
        }
#endif
#ifdef FLOAT
        float volts;
#ifdef STRETCH_TAKES_PRESSURE
        char sample[16];
        memcpy(&volts, &bits, sizeof volts);
        stretch_set_pressure(&state, volts);
        if (scanf("%15s", sample) != 1) {
            return 1;
        }
        memcpy(word, sample, sizeof word);
        bits = (uint32_t)strtoul(word, NULL, 16);
#endif
        memcpy(&volts, &bits, sizeof volts);
#ifdef STRETCH_ZERO_LEVEL
        {
            stretch_zero told;
            if (stretch_zero_step(&zero, word[0] == 'x' ? STRETCH_NO_SIGNAL : volts, &told)) {
                printf("zero %08lx %08lx %08lx %lu %u\n", (unsigned long)bits_of(&told.off),
                       (unsigned long)bits_of(&told.off_reference),
                       (unsigned long)bits_of(&told.followed), (unsigned long)told.since_samples,
                       (unsigned)told.shifted);
            }
            volts = stretch_zero_corrected(&zero, volts);
        }
#endif
        reading = word[0] == 'x' ? stretch_lost(&state) : stretch_step(&state, volts);
        rate = bits_of(&reading.rate);
#ifdef STRETCH_TELLS_SD
        sd = bits_of(&reading.sd);
#endif
#else
        reading = word[0] == 'x' ? stretch_lost(&state) : stretch_step(&state, (int32_t)bits);
#endif
        if (reading.status == STRETCH_OK) {
            printf("%u %u %08lx %08lx %08lx\n", (unsigned)reading.branch, (unsigned)reading.domain,
                   (unsigned long)bits_of(&reading.estimate), (unsigned long)rate,
                   (unsigned long)sd);
        } else {
            printf("%s\n", reading.status == STRETCH_WARMING ? "warming" : "missing");
        }
    }
    return 0;
}
