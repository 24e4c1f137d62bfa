/* Binds the names that generic code uses to one long double: see real.h.
 *
 * The scene's program alone is written for this binding, and of its functions those that
 * close loops finely (singularities/fine_gap.h). */
#include "simd/unbind.h"
#include "simd/scalar.h"
#define R_VECTOR 0
#define R_EXTENDED 1
#define real long double
#define rmask int64_t
#define RLANES 1
#define FN(name) mechc_extended_##name
#define R(number) ((long double)(number))
#define R_MASK(condition) (-(int64_t)(condition))
#define R_SELECT(mask, a, b) ((mask) ? (a) : (b))
#define R_ANY(mask) ((mask) != 0)
#define R_FMA(a, b, c) ((a) * (b) + (c))
#define R_FNMA(a, b, c) ((c) - (a) * (b))
#define R_FMS(a, b, c) ((a) * (b) - (c))
#define R_FNMS(a, b, c) (-(a) * (b) - (c))
#define R_SQRT(x) __builtin_sqrtl(x)
#define R_CALL(f, x) ((long double)f((double)(x)))
#define R_CALL2(f, x, y) ((long double)f((double)(x), (double)(y)))
