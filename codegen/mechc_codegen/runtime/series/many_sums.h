/* Sums over products of lower orders, where there are many of them; generic over `real`.
 *
 * In one trajectory they lie side by side in the lanes, in several a lane is a trajectory.  Either way
 * they are added up in the same order, the products with the first and the last row at the end, since
 * the last row is known last.
 */
#include "simd/real.h"
#if !R_VECTOR && !defined MECHC_MANY_SUMS
#define MECHC_MANY_SUMS
#include "dynamics/sizes.h"
#include "run/tableau.h"
#include "series/spread.h"
#include "scene_series.h"

#if MECHC_TAYLOR_SERIES && !MECHC_SERIES_FEW
/* The factors of all sums side by side, order after order, and the sums without the products with
 * the first and the last row. */
typedef struct {
    double left[MECHC_TAYLOR_MOST][MECHC_SPREAD_WIDTH_MAX] __attribute__((aligned(64)));
    double right[MECHC_TAYLOR_MOST][MECHC_SPREAD_WIDTH_MAX] __attribute__((aligned(64)));
    double middle[2][MECHC_SPREAD_WIDTH_MAX] __attribute__((aligned(64)));
    double none[MECHC_SERIES_MAX];
} mechc_scalar_series_sides;

MECHC_INLINE void mechc_scalar_series_begin(mechc_scalar_series_sides *sides)
{
    memset(sides->middle, 0, sizeof sides->middle);
    memset(sides->none, 0, sizeof sides->none);
}

/* The complete sums of an order; last: the row before. */
MECHC_INLINE void mechc_scalar_series_take(const mechc_scalar_series_sides *sides, int order,
                                           double (*rows)[MECHC_SERIES], const double *last,
                                           double *sums)
{
    const double *early = order > 2 ? rows[1] : sides->none;
    const double *first = order > 1 ? rows[1] : sides->none;
    mechc_scalar_series_ends(sides->middle[order & 1], early, first, last, sums);
}

/* Prepare an order of which only the last row is missing. */
MECHC_INLINE void mechc_scalar_series_prepare(mechc_scalar_series_sides *sides, int order)
{
    mechc_vector sum[MECHC_SPREAD_WIDTH_MAX / MECHC_LANES];
    const int width = MECHC_SPREAD_WIDTH / MECHC_LANES;
    for (int b = 0; b < width; b++) sum[b] = mechc_spread(0.0);
    for (int j = 2; j < order - 1; j++)
        for (int b = 0; b < width; b++)
            sum[b] = mechc_fused(mechc_take(sides->left[j], b),
                                 mechc_take(sides->right[order - j], b), sum[b]);
    for (int b = 0; b < width; b++) mechc_put(sum[b], sides->middle[order & 1], b);
}

MECHC_INLINE void mechc_scalar_series_put(mechc_scalar_series_sides *sides, int order,
                                          const double *row)
{
    mechc_scalar_series_spread(row, sides->left[order], sides->right[order]);
}
#endif
#endif
