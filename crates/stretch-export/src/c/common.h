/* How a reading came about: stretch_reading.status. */
#define STRETCH_OK 0      /* estimate, branch and domain hold */
#define STRETCH_WARMING 1 /* the rate has not seen enough samples yet */
#define STRETCH_MISSING 2 /* the sample did not come */

/* Which way the target moves: stretch_reading.branch. */
#define STRETCH_INFLATION 0
#define STRETCH_DEFLATION 1

/* Whether the inputs lay where the calibration was fitted: stretch_reading.domain. */
#define STRETCH_INSIDE 0
#define STRETCH_SIGNAL_CLAMPED 1 /* the signal was outside, and was clamped */
#define STRETCH_RATE_CLAMPED 2   /* its rate was; 3: both */

/* Missing samples in a row that are bridged; one more forgets the stream. */
#define STRETCH_MAX_BRIDGED 3

/* What a sample always needs belongs into the step, what it seldom needs apart from it. */
#if defined(__GNUC__)
#define STRETCH_INLINE static inline __attribute__((always_inline))
#define STRETCH_APART __attribute__((noinline, unused))
#else
#define STRETCH_INLINE static inline
#define STRETCH_APART
#endif

