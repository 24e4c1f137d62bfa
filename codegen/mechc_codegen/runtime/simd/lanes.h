/* Vectors of MECHC_LANES doubles, a number a lane. */
#pragma once

#include <stdint.h>
#include <string.h>
#if defined MECHC_OUTPUTS_ONLY /* reading them would take half of the time of a small unit */
#elif defined __AVX__
#include <immintrin.h>
#elif defined __SSE2__
#include <emmintrin.h> /* a fifth of them */
#endif

#include "abi/macros.h"

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
