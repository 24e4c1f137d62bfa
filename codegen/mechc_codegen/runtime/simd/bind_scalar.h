/* Binds the names that generic code uses to one double: see real.h. */
#include "simd/unbind.h"
#include "simd/scalar.h"
#define R_VECTOR 0
#define real double
#define rmask int64_t
#define RLANES 1
#define FN(name) mechc_scalar_##name
#define R(number) ((double)(number))
#define R_BITS(x) mechc_bits(x)
#define R_FROM_BITS(b) mechc_from_bits((int64_t)(b))
#define R_UNSIGNED(x) ((uint64_t)mechc_bits(x))
#define R_NUMBER(b) ((double)(b))
#define R_WHOLE(x) ((int64_t)(x))
#define R_MASK(condition) (-(int64_t)(condition))
#define R_SELECT(mask, a, b) ((mask) ? (a) : (b))
#define R_ANY(mask) ((mask) != 0)
#define R_ANY_BEYOND(x, limit) (!(__builtin_fabs(x) <= (limit)))
#define R_FMA(a, b, c) mechc_scalar_fused(a, b, c)
#define R_FNMA(a, b, c) mechc_scalar_fused(-(a), b, c)
#define R_FMS(a, b, c) mechc_scalar_fused(a, b, -(c))
#define R_FNMS(a, b, c) mechc_scalar_fused(-(a), b, -(c))
#define R_SQRT(x) __builtin_sqrt(x)
#define R_CALL(f, x) f(x)
#define R_CALL2(f, x, y) f(x, y)
#define R_GREATEST(x) (x)
