/* Vectors of MECHC_LANES doubles, a number a lane, and the macros that every header uses. */
#pragma once

#include <stdint.h>
#include <string.h>
#if defined MECHC_OUTPUTS_ONLY /* reading them would take half of the time of a small unit */
#elif defined __AVX__
#include <immintrin.h>
#elif defined __SSE2__
#include <emmintrin.h> /* a fifth of them */
#endif

#define MECHC_INLINE static inline __attribute__((always_inline, unused))
#define MECHC_STATIC static __attribute__((unused))
#define MECHC_ONCE static __attribute__((noinline, unused)) /* compiled once, called from many */
#define MECHC_RARE static __attribute__((cold, unused)) /* not in every step: compiled small */
#define MECHC_RARE_ONCE static __attribute__((cold, noinline, unused))
#ifdef __clang__ /* makes no copies for the constants of a call */
#define MECHC_SINGLE MECHC_ONCE
#else
#define MECHC_SINGLE MECHC_ONCE __attribute__((noclone))
#endif

#define MECHC_QUOTE_(x) #x
#define MECHC_QUOTE(x) MECHC_QUOTE_(x)
#define MECHC_JOIN_(a, b) a##b
#define MECHC_JOIN(a, b) MECHC_JOIN_(a, b)
#define MECHC_AT_LEAST_ONE(n) ((n) > 0 ? (n) : 1) /* no array in C is empty */

/* Inline, unlike fmax and fmin where the compiler must heed every NaN. */
MECHC_INLINE double mechc_max(double a, double b) { return a > b ? a : b; }
MECHC_INLINE double mechc_min(double a, double b) { return a < b ? a : b; }

typedef double mechc_vector __attribute__((vector_size(8 * MECHC_LANES)));
typedef int64_t mechc_mask __attribute__((vector_size(8 * MECHC_LANES)));
typedef uint64_t mechc_unsigned __attribute__((vector_size(8 * MECHC_LANES)));

MECHC_INLINE double mechc_sum_of_lanes(mechc_vector lanes)
{
    double part[MECHC_LANES];
    memcpy(part, &lanes, sizeof part);
    for (int half = MECHC_LANES / 2; half > 0; half /= 2)
        for (int i = 0; i < half; i++) part[i] += part[i + half];
    return part[0];
}
