/* Which way the target moves: stretch_reading.branch. */
#define STRETCH_INFLATION 0
#define STRETCH_DEFLATION 1

/* Whether the inputs lay where the calibration was fitted: stretch_reading.domain. */
#define STRETCH_INSIDE 0
#define STRETCH_SIGNAL_CLAMPED 1 /* the signal was outside, and was clamped */
#define STRETCH_RATE_CLAMPED 2   /* its rate was; 3: both */

