/* Direction in which the target moves: stretch_reading.branch. */
#define STRETCH_INFLATION 0
#define STRETCH_DEFLATION 1

/* Whether the inputs are in the range of the calibration: stretch_reading.domain. */
#define STRETCH_INSIDE 0
#define STRETCH_SIGNAL_CLAMPED 1 /* the signal was outside and was clamped */
#define STRETCH_RATE_CLAMPED 2   /* its rate was outside and was clamped; 3: both */

