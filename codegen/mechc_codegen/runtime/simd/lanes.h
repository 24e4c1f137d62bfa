/* Vectors of MECHC_LANES doubles, a number a lane. */
#pragma once

#include <stdint.h>
#include <string.h>
#include "abi/macros.h"

/* Inline, unlike fmax and fmin where the compiler must heed every NaN. */
MECHC_INLINE double mechc_max(double a, double b) { return a > b ? a : b; }
MECHC_INLINE double mechc_min(double a, double b) { return a < b ? a : b; }
/* Unlike pow, which the compiler may replace, and not to the same bits. */
MECHC_INLINE double mechc_squared(double x) { return x * x; }

/* Whether the processor has products and their additions in one instruction. */
#if defined __FMA__ || defined __ARM_FEATURE_FMA
#define MECHC_HAS_FUSED 1
#else
#define MECHC_HAS_FUSED 0
#endif

typedef double mechc_vector __attribute__((vector_size(8 * MECHC_LANES)));
typedef int64_t mechc_mask __attribute__((vector_size(8 * MECHC_LANES)));
typedef uint64_t mechc_unsigned __attribute__((vector_size(8 * MECHC_LANES)));
/* 64-bit numbers as the compiler's own names of instructions have them; reading immintrin.h for the
 * usual names takes gcc a third of a second, half of the time of a small unit. */
typedef long long mechc_quads __attribute__((vector_size(8 * MECHC_LANES)));

/* Sums of products over many numbers have eight parts, so that their bits do not depend on the lanes: part
 * k % 8 of number k.  A vector holds MECHC_LANES of the parts. */
#define MECHC_EIGHT (8 / MECHC_LANES)

MECHC_INLINE double mechc_sum_of_lanes(mechc_vector lanes)
{
    double part[MECHC_LANES];
    memcpy(part, &lanes, sizeof part);
    for (int half = MECHC_LANES / 2; half > 0; half /= 2)
        for (int i = 0; i < half; i++) part[i] += part[i + half];
    return part[0];
}

MECHC_INLINE double mechc_sum_of_parts(mechc_vector *parts)
{
    for (int half = MECHC_EIGHT / 2; half > 0; half /= 2)
        for (int i = 0; i < half; i++) parts[i] += parts[i + half];
    return mechc_sum_of_lanes(parts[0]);
}
