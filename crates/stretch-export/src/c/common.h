/* How a reading came about: stretch_reading.status. */
#define STRETCH_OK 0      /* estimate, branch and domain hold */
#define STRETCH_WARMING 1 /* the rate has not seen enough samples yet, and the model needs it */
#define STRETCH_MISSING 2 /* the sample did not come */

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

