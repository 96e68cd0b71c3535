/* The smallest program that uses a header on an ATmega328P. Its size shows how much flash and RAM the header needs. With
 * -DSTACK it sends the number of bytes of stack that the self-test needs, in hexadecimal. */
#include "stretch.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <stdint.h>

static stretch_state state;

#ifdef STRETCH_CHANNELS
static float samples[STRETCH_CHANNELS];
#endif

#ifdef STACK
extern uint8_t _end;
#define UNTOUCHED 0xa5

static void __attribute__((noinline)) send_stack(void)
{
    uint8_t *byte = &_end;
    uint8_t *const here = (uint8_t *)SP - 8;
    uint16_t used;
    int shift;
    for (; byte < here; byte++) {
        *byte = UNTOUCHED;
    }
    if (stretch_self_test() != 0) {
        return;
    }
    for (byte = &_end; *byte == UNTOUCHED; byte++) {
    }
    used = (uint16_t)(RAMEND - (uint16_t)byte + 1);
    for (shift = 8; shift >= 0; shift -= 4) {
        const uint8_t digit = (uint8_t)(used >> shift & 15);
        UDR0 = (uint8_t)(digit < 10 ? '0' + digit : 'a' + digit - 10);
    }
    UDR0 = '\n';
}
#endif

int main(void)
{
#ifdef STACK
    send_stack();
    cli();
    sleep_mode();
#endif
#ifdef SELF_TEST
    if (stretch_self_test() != 0) {
        return 1;
    }
#endif
    stretch_init(&state);
    for (;;) {
        stretch_reading reading;
#ifdef STRETCH_CHANNELS
        samples[0] = (float)ADC;
        reading = stretch_step(&state, samples);
#elif defined(FLOAT)
        reading = stretch_step(&state, (float)ADC);
#else
        reading = stretch_step(&state, (int32_t)ADC);
#endif
        /* keeps the compiler from removing the unused reading */
        __asm__ volatile("" : : "r"(&reading) : "memory");
    }
}
