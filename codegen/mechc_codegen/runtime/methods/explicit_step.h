/* One step of an explicit pair; generic over `real`: one trajectory, or one in each lane. */
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_EXPLICIT_STEP_VECTOR : !defined MECHC_EXPLICIT_STEP_SCALAR
#if R_VECTOR
#define MECHC_EXPLICIT_STEP_VECTOR
#else
#define MECHC_EXPLICIT_STEP_SCALAR
#endif
#include "abi/codes.h"
#include "dynamics/sizes.h"
#include "run/tableau.h"

/* Data of a step: its start, its length, and its rates, of which those of y come first. */
typedef struct {
    real t, h;
    const real *y, *compensation; /* of y: what rounding has left of the steps before */
    real *next_compensation;      /* of the end */
    real (*rates)[MECHC_NX_MAX];
} FN(explicit_data);

/* Rates of stage i at a state, which may be moved onto the constraints; MECHC_RUNNING or the
 * failure. */
typedef int FN(explicit_rates)(void *owner, int i, real t, real *state, real *rates);

/* sum_j row[j] rate_j, j < count */
MECHC_INLINE void FN(explicit_sum)(real (*rates)[MECHC_NX_MAX], const double *row, int count,
                                   real *sum)
{
    for (int i = 0; i < MECHC_NX; i++) sum[i] = row[0] * rates[0][i];
    for (int j = 1; j < count; j++)
        if (row[j] != 0.0)
            for (int i = 0; i < MECHC_NX; i++) R_ADD(sum[i], R(row[j]), rates[j][i]);
}

/* y + h sum_j matrix[i][j] rate_j */
MECHC_INLINE void FN(explicit_state)(const mechc_tableau *tableau, const FN(explicit_data) *step,
                                     int i, real *state)
{
    real sum[MECHC_NX_MAX];
    FN(explicit_sum)(step->rates, tableau->matrix + i * MECHC_MOST_RATES, i, sum);
    for (int n = 0; n < MECHC_NX; n++) state[n] = R_FMA(step->h, sum[n], step->y[n]);
}

/* The state at the step's end, by compensated summation.  Kahan (1965). */
MECHC_INLINE void FN(explicit_end)(const mechc_tableau *tableau, const FN(explicit_data) *step,
                                   real *end)
{
    real sum[MECHC_NX_MAX];
    const int last = tableau->stages;
    FN(explicit_sum)(step->rates, tableau->matrix + last * MECHC_MOST_RATES, last, sum);
    for (int n = 0; n < MECHC_NX; n++) {
        const real gain = R_FMA(step->h, sum[n], step->compensation[n]);
        end[n] = step->y[n] + gain;
        step->next_compensation[n] = gain - (end[n] - step->y[n]);
    }
}

/* Compute rates first .. last except those of the end; `state` is work space for their states. */
MECHC_INLINE int FN(explicit_stages)(const mechc_tableau *tableau, const FN(explicit_data) *step,
                                     int first, int last, FN(explicit_rates) *rates_of,
                                     void *owner, real *state)
{
    for (int i = first; i <= last; i++) {
        FN(explicit_state)(tableau, step, i, state);
        const real t = step->t + tableau->nodes[i] * step->h;
        const int status = rates_of(owner, i, t, state, step->rates[i]);
        if (status != MECHC_RUNNING) return status;
    }
    return MECHC_RUNNING;
}

/* Compute all stages, the end, and its rates. */
MECHC_INLINE int FN(explicit_step)(const mechc_tableau *tableau, const FN(explicit_data) *step,
                                   FN(explicit_rates) *rates_of, void *owner, real *end)
{
    const int last = tableau->stages;
    const int status =
        FN(explicit_stages)(tableau, step, 1, last - 1, rates_of, owner, end);
    if (status != MECHC_RUNNING) return status;
    FN(explicit_end)(tableau, step, end);
    return rates_of(owner, last, step->t + step->h, end, step->rates[last]);
}

/* The first `count` rows of the dense output, from all rates of the step. */
MECHC_INLINE void FN(explicit_dense)(const mechc_tableau *tableau, const FN(explicit_data) *step,
                                     const real *end, int count, real *rows)
{
    const real *first = step->rates[0], *last = step->rates[tableau->stages];
    for (int i = 0; i < MECHC_NX; i++) {
        const real r0 = end[i] - step->y[i], r1 = step->h * first[i] - r0;
        rows[i] = r0;
        rows[MECHC_NX + i] = r1;
        rows[2 * MECHC_NX + i] = r0 - step->h * last[i] - r1;
    }
    for (int row = 3; row < tableau->dense_rows; row++) {
        real sum[MECHC_NX_MAX];
        const double *weights = tableau->dense + (row - 3) * MECHC_MOST_RATES;
        FN(explicit_sum)(step->rates, weights, tableau->rates, sum);
        for (int i = 0; i < MECHC_NX; i++) rows[row * MECHC_NX + i] = step->h * sum[i];
    }
    for (int i = tableau->dense_rows * MECHC_NX; i < count * MECHC_NX; i++) rows[i] = R(0.0);
}

#endif
