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

#ifndef MECHC_NEAR_BY_ITSELF
#define MECHC_NEAR_BY_ITSELF 2
#endif

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
        *sine = FN(sin_beyond)(x, *sine);
        *cosine = FN(cos_beyond)(x, *cosine);
    }
}

/* Renew what is kept in `turn`, out of line as above: turn[1] and turn[2] are those of turn[0] = x. */
MECHC_ONCE void FN(renew_turn)(real x, real *turn)
{
    turn[0] = x;
    FN(sincos)(x, turn + 1, turn + 2);
}

/* Renew only the lanes in which x has changed much, by the amount given. */
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
 * is kept there by the little that x has changed, to the fifth order of it.  MECHC_NEAR_BY_ITSELF: no
 * lane's bits depend on the others. */
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
        if (near == MECHC_NEAR_BY_ITSELF) FN(renew_far_turns)(x, by, turn);
        else FN(renew_turn)(x, turn);
        by = x - turn[0];
    }
    const real square = by * by;
    const real s = by - by * square * (1.0 / 6.0);
    const real c = square * (square * (1.0 / 24.0) - 0.5);
    *sine = turn[1] + (turn[2] * s + turn[1] * c);
    *cosine = turn[2] + (turn[2] * c - turn[1] * s);
}

#endif
