/* A step of a Taylor series: how long it may be, where it ends; generic over `real`. */
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_TAYLOR_STEP_VECTOR : !defined MECHC_TAYLOR_STEP_SCALAR
#if R_VECTOR
#define MECHC_TAYLOR_STEP_VECTOR
#else
#define MECHC_TAYLOR_STEP_SCALAR
#endif
#include "dynamics/sizes.h"
#if MECHC_TAYLOR_SERIES
#include "series/coefficients.h"
#include "simd/rough.h"

#define MECHC_ROUGH_EXCESS 0.2288 /* of f (1 - f), in 1 + f over 2^f */
#define MECHC_TAYLOR_JUDGED 3 /* last orders: in a symmetric motion every other one may vanish */

/* The inverse of the tolerated error of each component: a part of its scale, or a number and a part
 * of its size; never less than rounding. */
MECHC_INLINE void FN(taylor_weights)(const real *y, const real *scale, const real *floor,
                                     real of_scale, real of_size, real *weights)
{
    for (int i = 0; i < MECHC_NX; i++) {
        const real size = R_SELECT(R_MASK(y[i] < 0.0), -y[i], y[i]);
        const real asked = R_FMA(of_scale, scale[i], R_FMA(of_size, size, floor[i]));
        const real digit = DBL_EPSILON * size;
        weights[i] = FN(rough_inverse)(R_SELECT(R_MASK(asked > digit), asked, digit));
    }
}

/* Squares of the last rows over what is tolerated, the highest order first; `weights`: one over
 * that. */
MECHC_INLINE void FN(taylor_sizes)(real (*rows)[MECHC_SERIES], int order, const real *weights,
                                   real *sizes)
{
    for (int k = 0; k < MECHC_TAYLOR_JUDGED; k++) {
        real sum = R(0.0);
        for (int i = 0; i < MECHC_NX; i++) {
            const real error = rows[order - k][i] * weights[i];
            sum = R_FMA(error, error, sum);
        }
        sizes[k] = sum * (1.0 / MECHC_NX);
    }
}

/* A rough power takes 1 + f for 2^f, six per cent too long a step at most, which at order 24 is four
 * times the error: corrected to half a per cent. */
MECHC_INLINE real FN(taylor_corrected)(real power)
{
    const real part =
        R_FROM_BITS((R_BITS(power) & INT64_C(0x000fffffffffffff)) | INT64_C(0x3ff0000000000000)) - 1.0;
    return power * (1.0 - MECHC_ROUGH_EXCESS * (part * (1.0 - part)));
}

/* The step, in units of the series' scale, at whose end none of the last terms is above what is
 * tolerated. */
MECHC_INLINE real FN(taylor_reach)(const real *sizes, int order)
{
    real reach = FN(rough_power)(sizes[0], -0.5 * mechc_inverse_of[order]);
    for (int k = 1; k < MECHC_TAYLOR_JUDGED; k++) {
        const real each = FN(rough_power)(sizes[k], -0.5 * mechc_inverse_of[order - k]);
        reach = R_SELECT(R_MASK(each < reach), each, reach);
    }
    return FN(taylor_corrected)(reach);
}

/* The series without its first row, over s; rows of even and of odd order are summed side by side. */
MECHC_INLINE void FN(taylor_sum)(real (*rows)[MECHC_SERIES], int order, real s, real *sum)
{
    const real square = s * s;
    real other[MECHC_NX];
    int k = order - 2;
    for (int i = 0; i < MECHC_NX; i++) sum[i] = rows[order][i], other[i] = rows[order - 1][i];
    for (; k > 1; k -= 2)
        for (int i = 0; i < MECHC_NX; i++) {
            sum[i] = R_FMA(sum[i], square, rows[k][i]);
            other[i] = R_FMA(other[i], square, rows[k - 1][i]);
        }
    for (int i = 0; i < MECHC_NX; i++)
        sum[i] = k ? R_FMA(other[i], s, R_FMA(sum[i], square, rows[1][i]))
                   : R_FMA(sum[i], s, other[i]);
}

/* The state at the part s of the scale, by compensated summation: Kahan (1965). */
MECHC_INLINE void FN(taylor_end)(real (*rows)[MECHC_SERIES], int order, real s,
                                 const real *compensation, real *next_compensation, real *end)
{
    real sum[MECHC_NX];
    FN(taylor_sum)(rows, order, s, sum);
    for (int i = 0; i < MECHC_NX; i++) {
        const real gain = R_FMA(sum[i], s, compensation[i]);
        end[i] = rows[0][i] + gain;
        next_compensation[i] = gain - (end[i] - rows[0][i]);
    }
}

/* The polynomial in the form of the dense output (run/dense_output.h) over a step of s: p = s r0 +
 * s (1 - s) (r1 + s (...)), by divisions by s and by s - 1 in turn. */
MECHC_INLINE void FN(taylor_dense)(real (*rows)[MECHC_SERIES], int order, real s,
                                   const real *end, int count, real *dense)
{
    for (int i = 0; i < MECHC_NX; i++) {
        real terms[MECHC_TAYLOR_MOST], power = s;
        for (int k = 0; k < order; k++, power *= s) terms[k] = rows[k + 1][i] * power;
        for (int n = 0; n < count; n++) {
            const int left = order - n; /* of the terms n .. order - 1 */
            if (left > 0 && n % 2 == 0)
                for (int k = order - 2; k >= n; k--) terms[k] = terms[k] + terms[k + 1];
            dense[n * MECHC_NX + i] = left > 0 ? terms[n] : R(0.0);
            if (n % 2 == 0)
                for (int k = n + 1; k < order; k++) terms[k] = -terms[k];
        }
        dense[i] = end[i] - rows[0][i]; /* to the last digit */
    }
}

#endif
#endif
