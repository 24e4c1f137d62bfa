/* Sums over products of lower orders, where there are few of them; generic over `real`.
 *
 * A lone sum is a chain of additions that the next order would wait for.  So the products with the
 * first two and the last two rows come last, since these rows are known last, and the others of two
 * orders are added up together before: a factor is loaded once for both.
 */
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_FEW_SUMS_VECTOR : !defined MECHC_FEW_SUMS_SCALAR
#if R_VECTOR
#define MECHC_FEW_SUMS_VECTOR
#else
#define MECHC_FEW_SUMS_SCALAR
#endif
#include <string.h>
#include "dynamics/sizes.h"
#include "scene_series.h"

#if MECHC_SERIES_FEW
typedef struct {
    real cores[2][MECHC_AT_LEAST_ONE(MECHC_SERIES_SUMS_MAX)]; /* of an even order and the next one */
    real none[MECHC_SERIES_MAX];
} FN(series_sides);

MECHC_INLINE void FN(series_begin)(FN(series_sides) *sides) { memset(sides, 0, sizeof *sides); }

/* Add the products with row n from either end; last: row order - n. */
MECHC_INLINE void FN(series_outer)(int n, int order, real (*rows)[MECHC_SERIES], const real *last,
                                   const real *none, const real *inner, real *sums)
{
    const real *early = order > 2 * n ? rows[n] : none;
    const real *first = order >= 2 * n ? rows[n] : none;
    FN(series_ends)(inner, early, first, last, sums);
}

/* The complete sums of an order; last: the row before. */
MECHC_INLINE void FN(series_take)(FN(series_sides) *sides, int order, real (*rows)[MECHC_SERIES],
                                  const real *last, real *sums)
{
    const real *before = rows[order > 2 ? order - 2 : 0];
    if (order % 2 == 0 && order > 4)
        FN(series_cores)(order, rows[0], sides->cores[0], sides->cores[1]);
    FN(series_outer)(2, order, rows, before, sides->none, sides->cores[order % 2], sums);
    FN(series_outer)(1, order, rows, last, sides->none, sums, sums);
}

#endif
#endif
