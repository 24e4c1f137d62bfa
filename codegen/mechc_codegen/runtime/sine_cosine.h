/* Sine and cosine of one argument with a shared range reduction; generic over `real`. */

/* Out of line, by value: the usual path keeps its registers. */
MECHC_ONCE __attribute__((cold)) real FN(sin_beyond)(real x) { return R_CALL(sin, x); }
MECHC_ONCE __attribute__((cold)) real FN(cos_beyond)(real x) { return R_CALL(cos, x); }

MECHC_INLINE void FN(sincos)(real x, real *sine, real *cosine)
{
    const real shifted = x * MECHC_TWO_OVER_PI + MECHC_ROUND;
    const rmask quadrant = R_BITS(shifted);
    const real n = shifted - MECHC_ROUND;
    const real r = ((x - n * MECHC_PIO2_A) - n * MECHC_PIO2_B) - n * MECHC_PIO2_C;
    const real z = r * r, zz = z * z;
    const real p = (MECHC_P0 + z * MECHC_P1) + zz * ((MECHC_P2 + z * MECHC_P3)
                 + zz * (MECHC_P4 + z * MECHC_P5));
    const real q = (MECHC_Q0 + z * MECHC_Q1) + zz * ((MECHC_Q2 + z * MECHC_Q3)
                 + zz * (MECHC_Q4 + z * MECHC_Q5));
    const real s = r + (r * z) * p;
    const real half = z * 0.5, near = 1.0 - half;
    const real c = near + (((1.0 - near) - half) + zz * q);
    const rmask swap = -(quadrant & 1);
    const rmask sine_sign = -(quadrant & 2) & INT64_MIN;
    const rmask cosine_sign = -((quadrant + 1) & 2) & INT64_MIN;
    *sine = R_FROM_BITS(R_BITS(R_SELECT(swap, c, s)) ^ sine_sign);
    *cosine = R_FROM_BITS(R_BITS(R_SELECT(swap, s, c)) ^ cosine_sign);
    if (__builtin_expect(R_ANY_BEYOND(x, MECHC_REDUCTION_LIMIT), 0)) {
        *sine = FN(sin_beyond)(x);
        *cosine = FN(cos_beyond)(x);
    }
}
