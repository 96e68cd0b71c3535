/* Status of a reading: stretch_reading.status. */
#define STRETCH_OK 0      /* estimate, branch and domain are valid */
#define STRETCH_WARMING 1 /* too few samples so far for the rate, which the model needs */
#define STRETCH_MISSING 2 /* the sample is missing */

/* Consecutive missing samples that are bridged. In a longer gap, the target is assumed to rest. */
#define STRETCH_MAX_BRIDGED 3

/* Code for every sample is inlined into the step; code that is seldom needed is kept out of it. */
#if defined(__GNUC__)
#define STRETCH_INLINE static inline __attribute__((always_inline))
#define STRETCH_APART __attribute__((noinline, unused))
#else
#define STRETCH_INLINE static inline
#define STRETCH_APART
#endif

