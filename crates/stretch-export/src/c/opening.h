/* A stretch receptor: @SIGNAL@ in, @REFERENCE@ out, every @PERIOD@ s.
 *
 * Model @MODEL@, form @FORM@: @TAKEN@ in,
 * @GIVEN@ out, with the same bits as the Rust receptor of this form.
@if fixed
 * Estimates have steps of @STEP@.
@end
@if float
 * A step takes the signal, not a code: STRETCH_ADC_ZERO + STRETCH_ADC_PER_CODE * code.
@end
 * Written by stretch @VERSION@ from a calibration of @FROM@.
 *
 *     stretch_state state;
 *     stretch_init(&state);
 *     then every period
@if crosstalk
 *     stretch_set_pressure(&state, pressure);
@end
@if one
 *     reading = stretch_step(&state, sample); or stretch_lost(&state) if it is missing
 *
 * One state per channel. C99 and C++11; no malloc, @LIBM@.
@end
@if array
 *     reading = stretch_step(&state, samples); or stretch_lost(&state) if all are missing
 *
 * One state per array of gauges; samples is an array of STRETCH_CHANNELS values. C99 and C++11; no malloc, @LIBM@.
@end
 * stretch_self_test() returns 0 if the board computes the same results as the computer.
 */
#if defined(STRETCH_H) && STRETCH_H + 0 != @ID@
#error "stretch: this file already includes another header of stretch export; include each header in a C or C++ file of its own"
#endif
#ifndef STRETCH_H
#define STRETCH_H @ID@ /* checksum of this file, another for every header */

#include <stdint.h>

