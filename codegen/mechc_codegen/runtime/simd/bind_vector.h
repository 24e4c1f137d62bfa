/* Binds the names that generic code uses to a vector of doubles: see real.h. */
#include "simd/unbind.h"
#include "simd/vector.h"
#define R_VECTOR 1
#define real mechc_vector
#define rmask mechc_mask
#define RLANES MECHC_LANES
#define FN(name) mechc_vector_##name
#define R(number) ((double)(number) - (mechc_vector){0}) /* x - 0 is x, x + 0 not */
#define R_BITS(x) ((mechc_mask)(x))
#define R_FROM_BITS(b) ((mechc_vector)(b))
#define R_UNSIGNED(x) ((mechc_unsigned)(x))
#define R_NUMBER(b) __builtin_convertvector(b, mechc_vector)
#define R_WHOLE(x) __builtin_convertvector(x, mechc_mask)
#define R_MASK(condition) (condition)
#define R_SELECT(mask, a, b) \
    R_FROM_BITS(((mask) & R_BITS(a)) | (~(mask) & R_BITS(b)))
#define R_ANY(mask) mechc_any(mask)
#define R_ANY_BEYOND(x, limit) mechc_any_beyond(x, limit)
#define R_FMA(a, b, c) mechc_fused(a, b, c)
#define R_FNMA(a, b, c) mechc_fused_off(a, b, c)
#define R_FMS(a, b, c) mechc_fused_less(a, b, c)
#define R_FNMS(a, b, c) mechc_fused_neither(a, b, c)
#define R_SQRT(x) mechc_sqrt(x)
#define R_CALL(f, x) mechc_each(f, x)
#define R_CALL2(f, x, y) mechc_each2(f, x, y)
#define R_GREATEST(x) mechc_greatest(x)
