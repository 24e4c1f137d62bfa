/* The explicit pairs of Dormand & Prince, every stage on the constraints. */
#pragma once

#include "methods/dormand_prince_lanes.h"
#include "methods/traits.h"
#include "simd/bind_scalar.h"
#include "dynamics/stage.h"
#include "methods/explicit_step.h"
#include "simd/unbind.h"

#define MECHC_ALL_RATES(run) ((double (*)[MECHC_NX_MAX])(run)->rates)

MECHC_STATIC mechc_scalar_explicit_data mechc_pair_data(mechc_integration *run, double h)
{
    return (mechc_scalar_explicit_data){
        run->head.t, h, run->y, run->compensation, run->next_compensation, MECHC_ALL_RATES(run),
    };
}

MECHC_STATIC int mechc_pair_rates(void *run, int i, double t, double *state, double *rates)
{
    (void)i;
    return mechc_rates_at(run, t, state, rates);
}

MECHC_STATIC int mechc_pair_step(mechc_integration *run, double h, double *end)
{
    const mechc_scalar_explicit_data step = mechc_pair_data(run, h);
    return mechc_scalar_explicit_step(run->current->tableau, &step, mechc_pair_rates, run, end);
}

/* Mean square of a step at these rates over what is tolerated. */
MECHC_STATIC double mechc_pair_norm(mechc_integration *run, const double *rates, double h, const double *end,
                                    const mechc_scalar_place *place)
{
    double change[MECHC_NX_MAX], square = 0.0;
    for (int i = 0; i < MECHC_NX; i++) change[i] = h * rates[i];
    if (place) mechc_project_error(place, change);
    for (int i = 0; i < MECHC_NX; i++) square += mechc_squared(change[i] / mechc_tolerance(run, i, end));
    return square / MECHC_NX;
}

/* Mean square of the step's error by one set of weights over what is tolerated. */
MECHC_STATIC double mechc_pair_square(mechc_integration *run, const double *weights, double h,
                                      const double *end, const mechc_scalar_place *place)
{
    double error[MECHC_NX_MAX];
    mechc_scalar_explicit_sum(MECHC_ALL_RATES(run), weights, run->current->tableau->stages + 1, error);
    return mechc_pair_norm(run, error, h, end, place);
}

/* Near a change point only what the projection of the end will keep of an error counts: the rest is
 * the closure's magnified rounding.  In a bend it is not, but for what no shorter step lowers: the
 * speeds turn there by what a step misses of it. */
MECHC_STATIC int mechc_only_kept_counts(const mechc_integration *run)
{
    const mechc_monitor *monitor = &run->monitor;
    return MECHC_NH > 0 && mechc_nears_critical(monitor, run->horizon)
        && (mechc_only_rounding_is_left(monitor) || !mechc_knows_bend(monitor));
}

/* Root mean square of the step's error over what is tolerated.  The two errors of dop853, E5 and E3, are put
 * together as Hairer, Norsett & Wanner do; of a fast component E5 vanishes at h lambda = -5.65, within the
 * region of stability, where E3^3 over the square of the step's change, of order 10, does not.  That is no
 * estimate where E3 is more than the change: a body at rest, whose rates are rounding. */
MECHC_STATIC double mechc_pair_error(mechc_integration *run, double h, const double *end)
{
    const mechc_tableau *tableau = run->current->tableau;
    mechc_scalar_place at_end, *place = 0;
    if (mechc_only_kept_counts(run)) {
        place = &at_end;
        mechc_locate(run->head.t + h, end, &run->given, place);
    }
    const double first = mechc_pair_square(run, tableau->error, h, end, place);
    if (!tableau->second_error) return sqrt(first);
    const double second = mechc_pair_square(run, tableau->second_error, h, end, place);
    if (first <= 0.0) return 0.0;
    run->alike = second <= MECHC_DOP853_ALIKE * first;
    const double both = first / sqrt(first + MECHC_DOP853_SECOND * second);
    const double change = mechc_pair_norm(run, MECHC_RATE(run, 0), h, end, place)
                        + mechc_pair_norm(run, MECHC_RATE(run, tableau->stages), h, end, place);
    return mechc_max(both, second * sqrt(second) / mechc_max(change, second));
}

/* Whether stability limits the step: two states at its end, the last stage's and the end's own, and
 * their rates estimate the largest eigenvalue.  Hairer & Wanner (1996), section IV.2. */
MECHC_STATIC int mechc_pair_limited(const mechc_integration *run, double h, const double *end,
                                    double step_error)
{
    const mechc_tableau *tableau = run->current->tableau;
    const int stage = tableau->stages - 1;
    double inner[MECHC_NX_MAX], rate = 0.0, state = 0.0;
    (void)step_error;
    const double *row = tableau->matrix + stage * MECHC_MOST_RATES;
    mechc_scalar_explicit_sum(MECHC_ALL_RATES(run), row, stage, inner);
    for (int i = 0; i < MECHC_NX; i++) {
        const double change = MECHC_RATE(run, stage + 1)[i] - MECHC_RATE(run, stage)[i];
        rate += mechc_squared(change / run->scale[i]);
        state += mechc_squared((end[i] - (run->y[i] + h * inner[i])) / run->scale[i]);
    }
    return state > 0.0 && fabs(h) * sqrt(rate / state) > mechc_stiff_bound(run, tableau);
}

/* Lanes do not know the rounding of an error. */
MECHC_STATIC int mechc_pair_stays_alone(const mechc_integration *run)
{
    return run->alike;
}

MECHC_STATIC int mechc_pair_dense_stages(mechc_integration *run, double h)
{
    const mechc_tableau *tableau = run->current->tableau;
    const mechc_scalar_explicit_data step = mechc_pair_data(run, h);
    double state[MECHC_NX_MAX];
    return mechc_scalar_explicit_stages(tableau, &step, tableau->stages + 1, tableau->rates - 1,
                                        mechc_pair_rates, run, state);
}

MECHC_STATIC void mechc_pair_dense(mechc_integration *run, double h, const double *end, int count,
                                   double *rows)
{
    const mechc_scalar_explicit_data step = mechc_pair_data(run, h);
    mechc_scalar_explicit_dense(run->current->tableau, &step, end, count, rows);
}

#define MECHC_PAIR_CODE /* what all pairs share */ \
    .step = mechc_pair_step, .error = mechc_pair_error, .factor = mechc_elementary_factor, \
    .shows_end = mechc_error_is_small, .limited = mechc_pair_limited, \
    .stays_alone = mechc_pair_stays_alone, \
    .dense_stages = mechc_pair_dense_stages, .dense = mechc_pair_dense

