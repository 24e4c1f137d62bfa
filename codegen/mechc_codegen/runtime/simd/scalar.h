/* The bits of one double. */
#pragma once

#include <stdint.h>
#include <string.h>
#include "simd/lanes.h"

MECHC_INLINE int64_t mechc_bits(double x)
{
    int64_t b = 0;
    memcpy(&b, &x, sizeof x);
    return b;
}
MECHC_INLINE double mechc_from_bits(int64_t b)
{
    double x;
    memcpy(&x, &b, sizeof x);
    return x;
}

/* a b + c, rounded once wherever vectors of this compilation are: see mechc_fused. */
MECHC_INLINE double mechc_scalar_fused(double a, double b, double c)
{
#if MECHC_HAS_FUSED
    return __builtin_fma(a, b, c);
#else
    return a * b + c;
#endif
}
