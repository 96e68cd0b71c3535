/* Direction in which the reference moves: stretch_reading.branch. */
#define STRETCH_RISING STRETCH_TARGET_@UP@
#define STRETCH_FALLING STRETCH_TARGET_@DOWN@
#define STRETCH_TARGET_RISES 0
#define STRETCH_TARGET_FALLS 1

/* Whether the inputs are in the range of the calibration: stretch_reading.domain. */
#define STRETCH_INSIDE 0
#define STRETCH_SIGNAL_CLAMPED 1 /* the signal was outside and was clamped */
#define STRETCH_RATE_CLAMPED 2   /* its rate was outside and was clamped; 3: both */

