/* Taylor coefficients of the motion at a state, by the recurrences of the scene; generic over `real`.
 *
 * Row k holds the coefficients of order k of every series, the states first.  Time is counted in
 * units of `scale`, so that a step of that length has the sum of its rows for an end.  Order k needs
 * sums over products a_j b_(k-j) of lower orders.  They do not depend on each other: in one
 * trajectory they lie side by side in the lanes, in several a lane is a trajectory.  Either way they
 * are added up in the same order, the products with the first and the last row at the end, since
 * the last row is known last.
 */
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_COEFFICIENTS_VECTOR : !defined MECHC_COEFFICIENTS_SCALAR
#if R_VECTOR
#define MECHC_COEFFICIENTS_VECTOR
#else
#define MECHC_COEFFICIENTS_SCALAR
#endif
#include "dynamics/sizes.h"
#if MECHC_TAYLOR_SERIES
#include "dynamics/given.h"
#include "series/order.h"
#include "series/spread.h"
#include "scene_series.h"
#include "simd/vector.h"

#if !R_VECTOR
/* The factors of all sums side by side, order after order, and what they add up to without the
 * products with the first and the last row. */
typedef struct {
    double left[MECHC_TAYLOR_MOST][MECHC_SPREAD_WIDTH] __attribute__((aligned(64)));
    double right[MECHC_TAYLOR_MOST][MECHC_SPREAD_WIDTH] __attribute__((aligned(64)));
    double middle[2][MECHC_SPREAD_WIDTH] __attribute__((aligned(64)));
    double none[MECHC_SERIES];
} mechc_series_sides;

MECHC_INLINE void mechc_series_begin(mechc_series_sides *sides)
{
    memset(sides->middle, 0, sizeof sides->middle);
    memset(sides->none, 0, sizeof sides->none);
}

/* Of an order of which only the last row is not there yet. */
MECHC_INLINE void mechc_series_middle(mechc_series_sides *sides, int order)
{
    mechc_vector sum[MECHC_SPREAD_WIDTH / MECHC_LANES];
    const int width = MECHC_SPREAD_WIDTH / MECHC_LANES;
    for (int b = 0; b < width; b++) sum[b] = mechc_spread(0.0);
    for (int j = 2; j < order - 1; j++)
        for (int b = 0; b < width; b++)
            sum[b] = mechc_fused(mechc_take(sides->left[j], b),
                                 mechc_take(sides->right[order - j], b), sum[b]);
    for (int b = 0; b < width; b++) mechc_put(sum[b], sides->middle[order & 1], b);
}

/* The whole sums of an order. */
MECHC_INLINE void mechc_series_take(const mechc_series_sides *sides, int order,
                                    double (*rows)[MECHC_SERIES], double *sums)
{
    const double *early = order > 2 ? rows[1] : sides->none;
    const double *first = order > 1 ? rows[1] : sides->none;
    mechc_scalar_series_ends(sides->middle[order & 1], early, first, rows[order - 1], sums);
}
#endif

/* The rows up to the order `last`. */
MECHC_ONCE void FN(series)(real t, const real *y, const FN(given) *given, real scale, int last,
                           real (*rows)[MECHC_SERIES])
{
    real kept[MECHC_AT_LEAST_ONE(MECHC_SERIES_KEPT)], rates[MECHC_NX];
    real sums[MECHC_AT_LEAST_ONE(MECHC_SERIES_SUMS)];
#if !R_VECTOR
    mechc_series_sides sides;
    mechc_series_begin(&sides);
#endif
    for (int i = 0; i < MECHC_NX; i++) rows[0][i] = y[i];
    FN(series_start)(t, y, y + MECHC_NQ, given, kept, rows[0], rates);
    for (int order = 1;; order++) {
        const real factor = scale * mechc_inverse_of[order];
        for (int i = 0; i < MECHC_NX; i++) rows[order][i] = factor * rates[i];
        if (order == last) return;
#if R_VECTOR
        FN(series_sums)(order, rows[0], sums);
#else
        mechc_series_take(&sides, order, rows, sums);
        if (order + 1 < last) mechc_series_middle(&sides, order + 1);
#endif
        FN(series_next)(R((double)order), R(mechc_inverse_of[order]),
                        order == 1 ? scale : R(0.0), given, kept, sums, rows[order], rates);
#if !R_VECTOR
        FN(series_spread)(rows[order], sides.left[order], sides.right[order]);
#endif
    }
}

#endif
#endif
