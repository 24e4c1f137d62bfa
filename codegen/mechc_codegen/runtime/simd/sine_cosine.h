/* Sine and cosine of one argument with a shared range reduction; generic over `real`. */
#include <math.h>
#include <stdint.h>
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_SINE_COSINE_VECTOR : !defined MECHC_SINE_COSINE_SCALAR
#if R_VECTOR
#define MECHC_SINE_COSINE_VECTOR
#else
#define MECHC_SINE_COSINE_SCALAR
#endif
#include "simd/constants.h"
#include "simd/lanes.h"

/* Whether x is small enough for the reduction. */
MECHC_INLINE rmask FN(reducible)(real x)
{
    return R_MASK(x <= MECHC_REDUCTION_LIMIT) & R_MASK(x >= -MECHC_REDUCTION_LIMIT);
}

/* The C library's results for large x, otherwise those found; out of line, by value: the usual path
 * keeps its registers. */
MECHC_ONCE __attribute__((cold)) real FN(sin_beyond)(real x, real found)
{
    return R_SELECT(FN(reducible)(x), found, R_CALL(sin, x));
}
MECHC_ONCE __attribute__((cold)) real FN(cos_beyond)(real x, real found)
{
    return R_SELECT(FN(reducible)(x), found, R_CALL(cos, x));
}

/* a + b z */
MECHC_INLINE real FN(linear)(real z, double a, double b) { return R_FMA(z, R(b), R(a)); }

MECHC_INLINE void FN(sincos)(real x, real *sine, real *cosine)
{
    const real shifted = R_FMA(x, R(MECHC_TWO_OVER_PI), R(MECHC_ROUND));
    const rmask quadrant = R_BITS(shifted);
    const real n = shifted - MECHC_ROUND;
    real r = x;
    R_SUB(r, n, R(MECHC_PIO2_A));
    R_SUB(r, n, R(MECHC_PIO2_B));
    R_SUB(r, n, R(MECHC_PIO2_C));
    const real z = r * r, zz = z * z;
    const real p = R_FMA(zz, R_FMA(zz, FN(linear)(z, MECHC_P4, MECHC_P5), FN(linear)(z, MECHC_P2, MECHC_P3)),
                         FN(linear)(z, MECHC_P0, MECHC_P1));
    const real q = R_FMA(zz, R_FMA(zz, FN(linear)(z, MECHC_Q4, MECHC_Q5), FN(linear)(z, MECHC_Q2, MECHC_Q3)),
                         FN(linear)(z, MECHC_Q0, MECHC_Q1));
    const real s = R_FMA(r * z, p, r);
    const real near = FN(linear)(z, 1.0, -0.5);
    const real c = near + R_FMA(zz, q, R_FNMA(z, R(0.5), 1.0 - near));
    const rmask swap = -(quadrant & 1);
    const rmask sine_sign = -(quadrant & 2) & INT64_MIN;
    const rmask cosine_sign = sine_sign ^ (swap & INT64_MIN);
    *sine = R_FROM_BITS(R_BITS(R_SELECT(swap, c, s)) ^ sine_sign);
    *cosine = R_FROM_BITS(R_BITS(R_SELECT(swap, s, c)) ^ cosine_sign);
    if (__builtin_expect(R_ANY_BEYOND(x, MECHC_REDUCTION_LIMIT), 0)) {
        *sine = FN(sin_beyond)(x, *sine);
        *cosine = FN(cos_beyond)(x, *cosine);
    }
}

/* Renew what is kept in `turn`, turn[1] and turn[2] those of turn[0] = x, in the lanes in which x has changed
 * much, by the amount given; out of line as above. */
MECHC_ONCE void FN(renew_far_turns)(real x, real by, real *turn)
{
    const rmask near = R_MASK(by <= MECHC_NEAR_ANGLE) & R_MASK(by >= -MECHC_NEAR_ANGLE);
    real sine, cosine;
    FN(sincos)(x, &sine, &cosine);
    turn[0] = R_SELECT(near, turn[0], x);
    turn[1] = R_SELECT(near, turn[1], sine);
    turn[2] = R_SELECT(near, turn[2], cosine);
}

/* Sine and cosine of x, kept in `turn` with x where that is not NULL; near: found by turning what
 * is kept there by the little that x has changed, to the fifth order of it.  No lane's bits
 * depend on the others. */
MECHC_INLINE void FN(turn)(real x, real *turn, int near, real *sine, real *cosine)
{
    if (!turn || !near) FN(sincos)(x, sine, cosine);
    if (!turn) return;
    if (!near) {
        turn[0] = x;
        turn[1] = *sine;
        turn[2] = *cosine;
        return;
    }
    real by = x - turn[0];
    if (__builtin_expect(R_ANY_BEYOND(by, MECHC_NEAR_ANGLE), 0)) {
        FN(renew_far_turns)(x, by, turn);
        by = x - turn[0];
    }
    const real square = by * by;
    const real s = R_FNMA(by * square, R(1.0 / 6.0), by);
    const real c = square * FN(linear)(square, -0.5, 1.0 / 24.0);
    *sine = turn[1] + R_FMA(turn[2], s, turn[1] * c);
    *cosine = turn[2] + R_FNMA(turn[1], s, turn[2] * c);
}

#endif
