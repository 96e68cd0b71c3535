/* Standard input and output of a harness on an ATmega328P: text in flash, and the serial port. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/sleep.h>
#include <stdint.h>
#include <stdio.h>

static const char input[] PROGMEM =
#include "input.h"
    ;
static uint16_t at;

static int next_letter(FILE *file)
{
    const uint8_t letter = pgm_read_byte(&input[at]);
    (void)file;
    if (letter == 0) {
        return _FDEV_EOF;
    }
    at++;
    return letter;
}

static int send_letter(char letter, FILE *file)
{
    (void)file;
    UDR0 = (uint8_t)letter;
    return 0;
}

static FILE from_flash, to_port;

__attribute__((constructor)) static void connect(void)
{
    fdev_setup_stream(&from_flash, NULL, next_letter, _FDEV_SETUP_READ);
    fdev_setup_stream(&to_port, send_letter, NULL, _FDEV_SETUP_WRITE);
    stdin = &from_flash;
    stdout = &to_port;
}

/* The simulator ends when the processor sleeps and no interrupt can wake it. */
__attribute__((destructor)) static void end(void)
{
    cli();
    sleep_mode();
}
