/* Binds the names that generic code uses to one double. */
#include "simd/unbind.h"
#define real double
#define rmask int64_t
#define RLANES 1
#define FN(name) mechc_scalar_##name
#define R(number) ((double)(number))
#define R_BITS(x) mechc_bits(x)
#define R_FROM_BITS(b) mechc_from_bits(b)
#define R_MASK(condition) (-(int64_t)(condition))
#define R_SELECT(mask, a, b) ((mask) ? (a) : (b))
#define R_ANY(mask) ((mask) != 0)
#define R_ANY_BEYOND(x, limit) (!(__builtin_fabs(x) <= (limit)))
#define R_SQRT(x) __builtin_sqrt(x)
#define R_CALL(f, x) f(x)
#define R_CALL2(f, x, y) f(x, y)
#define R_GREATEST(x) (x)
#define R_LEAST(x) (x)

#ifndef MECHC_SCALAR_BITS
#define MECHC_SCALAR_BITS
MECHC_INLINE int64_t mechc_bits(double x)
{
    int64_t b;
    memcpy(&b, &x, sizeof b);
    return b;
}
MECHC_INLINE double mechc_from_bits(int64_t b)
{
    double x;
    memcpy(&x, &b, sizeof x);
    return x;
}
#endif
