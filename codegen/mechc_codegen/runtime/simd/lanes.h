/* Vectors of MECHC_LANES doubles, a number a lane. */
#pragma once

#include <stdint.h>
#include <string.h>
#include "abi/macros.h"

/* Inline, unlike fmax and fmin where the compiler must heed every NaN. */
MECHC_INLINE double mechc_max(double a, double b) { return a > b ? a : b; }
MECHC_INLINE double mechc_min(double a, double b) { return a < b ? a : b; }

typedef double mechc_vector __attribute__((vector_size(8 * MECHC_LANES)));
typedef int64_t mechc_mask __attribute__((vector_size(8 * MECHC_LANES)));
typedef uint64_t mechc_unsigned __attribute__((vector_size(8 * MECHC_LANES)));
/* 64-bit numbers as the compiler's own names of instructions have them; reading immintrin.h for the
 * usual names takes gcc a third of a second, half of the time of a small unit. */
typedef long long mechc_quads __attribute__((vector_size(8 * MECHC_LANES)));

MECHC_INLINE double mechc_sum_of_lanes(mechc_vector lanes)
{
    double part[MECHC_LANES];
    memcpy(part, &lanes, sizeof part);
    for (int half = MECHC_LANES / 2; half > 0; half /= 2)
        for (int i = 0; i < half; i++) part[i] += part[i + half];
    return part[0];
}
