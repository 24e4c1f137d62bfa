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
#include <string.h>
#include "series/coefficients.h"
#include "series/dense_terms.h"
#include "simd/vector.h"
#include "simd/rough.h"

#define MECHC_ROUGH_EXCESS 0.2288 /* of f (1 - f), in 1 + f over 2^f */
#define MECHC_TAYLOR_DISAGREES 100.0 /* what is tolerated: rates of a step's end differ by more beyond
                                        the series; rounding makes 40 at rtol 1e-13 */
#define MECHC_TAYLOR_JUDGED 3 /* last orders: in a symmetric motion every other one may vanish */

/* The inverse of the tolerated error of each component: a part of its scale, or a number and a part
 * of its size, times `part`; never less than rounding. */
MECHC_INLINE void FN(taylor_weights)(const real *y, const real *scale, const real *floor,
                                     real of_scale, real of_size, real part, real *weights)
{
    for (int i = 0; i < MECHC_NX; i++) {
        const real size = R_SELECT(R_MASK(y[i] < 0.0), -y[i], y[i]);
        const real asked = R_FMA(of_scale, scale[i], R_FMA(of_size, size, floor[i])) * part;
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

/* A state moved along the last terms, the direction of the fastest component, by what is tolerated. */
MECHC_INLINE void FN(taylor_moved)(const real *y, real (*rows)[MECHC_SERIES], int order,
                                   const real *sizes, real *moved)
{
    const real push = MECHC_TAYLOR_UNSEEN * R_SQRT(1.0 / sizes[0]);
    for (int i = 0; i < MECHC_NX; i++) moved[i] = R_FMA(rows[order][i], push, y[i]);
}

/* The square of |lambda h| of that component, from the rates at the moved state. */
MECHC_INLINE real FN(taylor_stiffness)(const real *rates, real (*rows)[MECHC_SERIES], real scale,
                                       const real *weights, real h)
{
    const real part = h / scale;
    real sum = R(0.0);
    for (int i = 0; i < MECHC_NX; i++) {
        const real change = (h * rates[i] - part * rows[1][i]) * weights[i];
        sum = R_FMA(change, change, sum);
    }
    return sum * (1.0 / (MECHC_NX * MECHC_TAYLOR_UNSEEN * MECHC_TAYLOR_UNSEEN));
}

/* The series without its first row, over s; rows of even and of odd order are summed side by side. */
MECHC_INLINE void FN(taylor_sum)(real (*rows)[MECHC_SERIES], int order, real s, real *sum)
{
    const real square = s * s;
    real other[MECHC_NX_MAX];
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
    real sum[MECHC_NX_MAX];
    FN(taylor_sum)(rows, order, s, sum);
    for (int i = 0; i < MECHC_NX; i++) {
        const real gain = R_FMA(sum[i], s, compensation[i]);
        end[i] = rows[0][i] + gain;
        next_compensation[i] = gain - (end[i] - rows[0][i]);
    }
}

/* Rows of the dense output of one component from the terms of its series, small terms first. */
MECHC_INLINE void FN(dense_rows)(const real *terms, int order, int count, real *dense)
{
#if R_VECTOR
    real pairs[MECHC_DENSE_PAIRS][2];
    memset(pairs, 0, sizeof pairs);
    for (int k = order - 1; k >= 0; k--)
        for (int m = 0; m <= k / 2; m++) {
            const real number = R(mechc_dense_of_terms[k][m]);
            pairs[m][0] = R_FMA(terms[k], number, pairs[m][0]);
            pairs[m][1] = R_FMA(-terms[k + 1], number, pairs[m][1]);
        }
    for (int n = 0; n < count; n++) dense[n * MECHC_NX] = pairs[n / 2][n % 2];
#else
    union {
        mechc_vector vector[MECHC_DENSE_PAIRS / MECHC_LANES];
        double number[MECHC_DENSE_PAIRS];
    } even = {{{0}}}, odd = {{{0}}};
    for (int k = order - 1; k >= 0; k--) {
        const mechc_vector *numbers = (const mechc_vector *)mechc_dense_of_terms[k];
        const mechc_vector here = mechc_spread(terms[k]), next = mechc_spread(-terms[k + 1]);
        for (int m = 0; m <= k / 2 / MECHC_LANES; m++) {
            even.vector[m] = mechc_fused(here, numbers[m], even.vector[m]);
            odd.vector[m] = mechc_fused(next, numbers[m], odd.vector[m]);
        }
    }
    for (int n = 0; n < count; n++)
        dense[n * MECHC_NX] = (n % 2 ? odd.number : even.number)[n / 2];
#endif
}

/* Rates that the equations give are those of the speeds, where q' is u. */
#define MECHC_TAYLOR_FIRST_RATE (MECHC_IDENTITY_KINEMATICS ? MECHC_NQ : 0)

/* The square of what the series' rates at the part s of the scale and those of the equations there
 * differ by, over what may be.  The first term that a series lacks is small where it converges, and its
 * rate as many times as large as its order says. */
MECHC_INLINE real FN(taylor_defect)(real (*rows)[MECHC_SERIES], int order, real s, real scale,
                                    const real *rates, const real *weights)
{
    const double count = MECHC_NX - MECHC_TAYLOR_FIRST_RATE;
    const real square = s * s;
    real sum = R(0.0), slope[MECHC_NX_MAX], other[MECHC_NX_MAX];
    int k = order - 1;
    for (int i = MECHC_TAYLOR_FIRST_RATE; i < MECHC_NX; i++)
        slope[i] = order * rows[order][i], other[i] = R(0.0);
    for (; k > 1; k -= 2) /* terms of even and of odd order side by side, as in taylor_sum */
        for (int i = MECHC_TAYLOR_FIRST_RATE; i < MECHC_NX; i++) {
            other[i] = R_FMA(other[i], square, k * rows[k][i]);
            slope[i] = R_FMA(slope[i], square, (k - 1) * rows[k - 1][i]);
        }
    for (int i = MECHC_TAYLOR_FIRST_RATE; i < MECHC_NX; i++) {
        const real of_end = k ? R_FMA(slope[i], s, R_FMA(other[i], square, rows[1][i]))
                              : R_FMA(other[i], s, slope[i]);
        const real error = (of_end - scale * rates[i]) * s * weights[i];
        sum = R_FMA(error, error, sum);
    }
    const double most = MECHC_TAYLOR_DISAGREES * order;
    return sum * (1.0 / (count * most * most));
}

/* The polynomial in the form of the dense output over a step of s. */
MECHC_INLINE void FN(taylor_dense)(real (*rows)[MECHC_SERIES], int order, real s,
                                   const real *end, int count, real *dense)
{
    for (int i = 0; i < MECHC_NX; i++) {
        real terms[MECHC_TAYLOR_MOST + 1], power = s;
        for (int k = 0; k < order; k++, power *= s) terms[k] = rows[k + 1][i] * power;
        terms[order] = R(0.0);
        FN(dense_rows)(terms, order, count, dense + i);
        dense[i] = end[i] - rows[0][i]; /* to the last digit */
    }
}

/* The limit that branches of roots put on a step.
 *
 * A square root and a power are positive.  What they are taken of may touch zero, as that of
 * sqrt(x^2 + x^4): there the equations have a corner, but the series of the root goes on smoothly,
 * with the other sign.  So a step ends just past the first zero of such a series, and the next one
 * begins on the other branch, as a step ends at a corner of Abs. */
#if MECHC_SERIES_ROOTS_MAX

/* The least share of its first value that a root surely keeps up to the part s of the scale: no term
 * is larger than it is at the end. */
MECHC_INLINE real FN(branches_kept)(real (*rows)[MECHC_SERIES], int order, real s)
{
    real least = R(1.0);
    for (int n = 0; n < MECHC_SERIES_ROOTS; n++) {
        const int place = mechc_root_places[n];
        const real value = rows[0][place], inverse = 1.0 / value;
        real change = R(0.0);
        for (int k = order - 1; k > 0; k--) {
            const real term = rows[k][place] * inverse;
            change = (change + R_SELECT(R_MASK(term < 0.0), -term, term)) * s;
        }
        const real kept = 1.0 - change;
        least = R_SELECT(R_MASK(kept > least), least, kept);
    }
    return least;
}
#endif
#endif
#endif
