/* Taylor coefficients of the motion at a state, by the recurrences of the scene; generic over `real`.
 *
 * Row k holds the coefficients of order k of every series, the states first.  Time is counted in
 * units of `scale`, so that a step of that length has the sum of its rows for an end.  Order k needs
 * sums over products a_j b_(k-j) of lower orders, which do not depend on each other: few_sums.h and
 * many_sums.h.
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
#include "series/spread.h"
#include "series/few_sums.h"
#include "series/many_sums.h"
#include "series/order.h"
#include "scene_series.h"

/* The rows of coefficients of a work space. */
#define MECHC_ROWS(work) ((__typeof__(*(work)->rows)(*)[MECHC_SERIES])(work)->rows)

/* Compute the rows up to the order `last`.  With few series the current row stays in registers, since the
 * next one waits for it.  Integrated series have their row from the rates of the row before; in scenes
 * integrated by their momenta M u these have the places of the speeds until the speeds follow. */
MECHC_ONCE void FN(series)(real t, const real *y, const FN(given) *given, real scale, int last,
                           real (*rows)[MECHC_SERIES])
{
    real kept[MECHC_AT_LEAST_ONE(MECHC_SERIES_KEPT_MAX)];
    real rates[MECHC_SERIES_INTEGRATED_MAX], near[MECHC_SERIES_MAX];
    real sums[MECHC_AT_LEAST_ONE(MECHC_SERIES_SUMS_MAX)];
    const int summed = last - 1 + MECHC_SERIES_MOMENTA; /* the last order that needs sums */
#if MECHC_SERIES_FEW || !R_VECTOR
    FN(series_sides) sides; /* sums of an order are begun before it */
    FN(series_begin)(&sides);
#endif
    for (int i = 0; i < MECHC_NX; i++) rows[0][i] = y[i];
    FN(series_start)(t, y, y + MECHC_NQ, given, kept, rows[0], rates);
    for (int i = 0; i < MECHC_SERIES; i++) near[i] = rows[0][i];
    for (int order = 1;; order++) {
        const real factor = scale * mechc_inverse_of[order];
        real *row = MECHC_SERIES_FEW ? near : rows[order];
#if MECHC_SERIES_FEW
        if (order <= summed) FN(series_take)(&sides, order, rows, near, sums);
#endif
        for (int i = 0; i < MECHC_SERIES_INTEGRATED; i++) row[i] = rows[order][i] = factor * rates[i];
        if (order > summed) return;
#if MECHC_SERIES_MOMENTA
        if (order == last) {
#if R_VECTOR && !MECHC_SERIES_FEW
            FN(series_last_sums)(order, rows[0], sums);
#elif !MECHC_SERIES_FEW
            FN(series_take)(&sides, order, rows, rows[order - 1], sums); /* what is not used costs little */
#endif
            FN(series_solve)(given, kept, sums, row);
            for (int i = MECHC_NQ; i < MECHC_NX; i++) rows[order][i] = row[i];
            return;
        }
#endif
#if R_VECTOR && !MECHC_SERIES_FEW
        FN(series_sums)(order, rows[0], sums);
#elif !MECHC_SERIES_FEW
        FN(series_take)(&sides, order, rows, rows[order - 1], sums);
        if (order < summed) FN(series_prepare)(&sides, order + 1);
#endif
        FN(series_next)(R((double)order), R(mechc_inverse_of[order]),
                        order == 1 ? scale : R(0.0), given, kept, sums, row, rates);
        for (int i = MECHC_NQ; MECHC_SERIES_FEW && i < MECHC_SERIES; i++) rows[order][i] = row[i];
#if !R_VECTOR && !MECHC_SERIES_FEW
        FN(series_put)(&sides, order, row);
#endif
    }
}

#endif
#endif
