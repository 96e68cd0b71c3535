/* A stretch receptor: @SIGNAL@ in, @REFERENCE@ out, every @PERIOD@ s.
 *
 * Model @MODEL@, form @FORM@: @TAKEN@ in,
 * @GIVEN@ out; the same bits as on the computer.
@if fixed
 * The least step of an estimate is @STEP@.
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
 *     reading = stretch_step(&state, sample); or stretch_lost(&state) where none came
 *
 * One state a channel. C99 and C++11; no malloc, @LIBM@.
@end
@if array
 *     reading = stretch_step(&state, samples); or stretch_lost(&state) where none came
 *
 * One state an array of gauges; samples is an array of STRETCH_CHANNELS. C99 and C++11; no malloc, @LIBM@.
@end
 * stretch_self_test() is 0 where the board computes as the computer does.
 */
#ifndef STRETCH_H
#define STRETCH_H

#include <stdint.h>

