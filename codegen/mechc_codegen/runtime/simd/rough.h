/* Roots and inverses that are right to a few per cent; generic over `real`.  The bits of a double
 * read as an integer are nearly its logarithm. */
#include <stdint.h>
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_ROUGH_VECTOR : !defined MECHC_ROUGH_SCALAR
#if R_VECTOR
#define MECHC_ROUGH_VECTOR
#else
#define MECHC_ROUGH_SCALAR
#endif
#include "simd/lanes.h"

/* 1/x within an eighth, for positive x: exponent and mantissa subtracted as one integer. */
MECHC_INLINE real FN(rough_inverse)(real x)
{
    return R_FROM_BITS(UINT64_C(0x7fde623822fc16e6) - R_UNSIGNED(x));
}

/* x^(-1/16) within three per cent, for x >= 0, likewise: a sixteenth of it is subtracted. */
MECHC_INLINE real FN(rough_root)(real x)
{
    return R_FROM_BITS(UINT64_C(0x43ee500000000000) - (R_UNSIGNED(x) >> 4));
}

/* x^e within a tenth, for x >= 0 and |e| < 1. */
MECHC_INLINE real FN(rough_power)(real x, double e)
{
    const real one = R(4607182418800017408.0); /* the bits of 1 */
    return R_FROM_BITS(R_WHOLE(R_FMA(R(e), R_NUMBER(R_BITS(x)) - one, one)));
}

#endif
