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
#if R_VECTOR ? !defined MECHC_TAYLOR_SERIES_VECTOR : !defined MECHC_TAYLOR_SERIES_SCALAR
#if R_VECTOR
#define MECHC_TAYLOR_SERIES_VECTOR
#else
#define MECHC_TAYLOR_SERIES_SCALAR
#endif
#include "dynamics/given.h"
#include "dynamics/sizes.h"
#include "methods/taylor_order.h"
#include "methods/taylor_spread.h"
#include "scene_series.h"
#include "simd/vector.h"

typedef real FN(series_rows)[MECHC_TAYLOR_MOST + 1][MECHC_SERIES];

#if R_VECTOR
typedef struct {
    real sums[2][MECHC_AT_LEAST_ONE(MECHC_SERIES_SUMS)];
} FN(series_sides);

MECHC_INLINE void FN(series_keep)(FN(series_sides) *sides, int order, const real *row)
{
    (void)sides, (void)order, (void)row;
}

MECHC_INLINE void FN(series_middle)(FN(series_sides) *sides, int order, const real *rows)
{
    FN(series_sums)(order, rows, sides->sums[order & 1]);
}
#else
/* The factors of all sums side by side, order after order, and what they add up to. */
typedef struct {
    double left[MECHC_TAYLOR_MOST][MECHC_SPREAD_WIDTH] __attribute__((aligned(64)));
    double right[MECHC_TAYLOR_MOST][MECHC_SPREAD_WIDTH] __attribute__((aligned(64)));
    double sums[2][MECHC_SPREAD_WIDTH] __attribute__((aligned(64)));
} FN(series_sides);

MECHC_INLINE void FN(series_keep)(FN(series_sides) *sides, int order, const real *row)
{
    FN(series_spread)(row, sides->left[order], sides->right[order]);
}

/* Without the products with the first and the last row. */
MECHC_INLINE void FN(series_middle)(FN(series_sides) *sides, int order, const real *rows)
{
    mechc_vector sum[MECHC_SPREAD_WIDTH / MECHC_LANES];
    (void)rows;
    for (int b = 0; b < MECHC_SPREAD_WIDTH / MECHC_LANES; b++) sum[b] = mechc_spread(0.0);
    for (int j = 2; j < order - 1; j++)
        for (int b = 0; b < MECHC_SPREAD_WIDTH / MECHC_LANES; b++)
            sum[b] = mechc_fused(mechc_take(sides->left[j], b),
                                 mechc_take(sides->right[order - j], b), sum[b]);
    for (int b = 0; b < MECHC_SPREAD_WIDTH / MECHC_LANES; b++) mechc_put(sum[b], sides->sums[order & 1], b);
}
#endif

/* The rows up to the order `last`. */
MECHC_ONCE void FN(series)(real t, const real *y, const FN(given) *given, real scale, int last,
                           real (*rows)[MECHC_SERIES])
{
    real kept[MECHC_AT_LEAST_ONE(MECHC_SERIES_KEPT)], rates[MECHC_NX], none[MECHC_SERIES];
    FN(series_sides) sides;
    memset(sides.sums, 0, sizeof sides.sums);
    for (int i = 0; i < MECHC_SERIES; i++) none[i] = R(0.0);
    for (int i = 0; i < MECHC_NX; i++) rows[0][i] = y[i];
    FN(series_start)(t, y, y + MECHC_NQ, given, kept, rows[0], rates);
    for (int order = 1;; order++) {
        const real factor = scale * mechc_inverse_of[order];
        for (int i = 0; i < MECHC_NX; i++) rows[order][i] = factor * rates[i];
        if (order == last) return;
        /* those of the next order need nothing of this one */
        if (order + 1 < last) FN(series_middle)(&sides, order + 1, rows[0]);
        const real *first = order > 1 ? rows[1] : none, *early = order > 2 ? rows[1] : none;
        FN(series_next)(R((double)order), R(mechc_inverse_of[order]),
                        order == 1 ? scale : R(0.0), given, kept,
                        sides.sums[order & 1], early, first, rows[order - 1], rows[order], rates);
        FN(series_keep)(&sides, order, rows[order]);
    }
}

#endif
