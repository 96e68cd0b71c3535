#include <float.h>

/* The same bits as the Rust receptor in f32: each operation rounded by itself, in 32 bits. */
#if defined(__FAST_MATH__)
#error "stretch: compile without -ffast-math, which gives other bits"
#endif
#if defined(FLT_EVAL_METHOD) && FLT_EVAL_METHOD != 0
#error "stretch: float is computed in more than 32 bits; on x86 add -msse2 -mfpmath=sse"
#endif
/* No fused multiply-add. Clang and GCC obey these pragmas; for other compilers pass
 * -ffp-contract=off or the equivalent option. */
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC push_options
#pragma GCC optimize("fp-contract=off")
@if sd
#pragma GCC optimize("no-math-errno") /* the square root becomes one instruction if the CPU has it */
@end
#endif

/* A sample beyond this size, or one that is not a number, is a missing sample. */
#define STRETCH_LARGEST 1e18f
#define STRETCH_NO_SIGNAL 2e18f

/* false for NaN as well */
STRETCH_INLINE int stretch_usable(float x)
{
    return x >= -STRETCH_LARGEST && x <= STRETCH_LARGEST;
}

