/* Rates of a state on the constraints, counted and watched.
 *
 * A state is moved onto the constraints before its accelerations are taken, because off them by d
 * they are wrong by d over the smallest singular value of the Jacobian.
 */
#pragma once

#include "abi/parts.h"
#include "run/integration.h"
#include "singularities/fine_gap.h"

/* Conditioning of the configuration rows; rows that are redundant everywhere do not count. */
MECHC_STATIC double mechc_conditioning(const mechc_integration *run,
                                       const mechc_scalar_place *place)
{
#if MECHC_NH_MAX > 0
    if (MECHC_NH == 0) return 1.0;
    const int counts = run->monitor.rank == 0 || run->monitor.rank == MECHC_NH;
    if (counts && (MECHC_NC == MECHC_NH || MECHC_WALKED)) {
        const double every = mechc_scalar_conditioning(place); /* no more than that of some rows */
        if (MECHC_NC == MECHC_NH || every > MECHC_CLEAR) return every;
    }
    mechc_weakest weakest;
    mechc_weakest_of(place, run->monitor.rank, &weakest);
    return weakest.ratio;
#else
    (void)run, (void)place;
    return 1.0;
#endif
}

/* The change of a component over which its derivatives are differences: near sqrt(eps), of its scale or
 * of a size so many times as large. */
#define MECHC_LARGE_VALUE 1e-2

MECHC_INLINE double mechc_small_change(double scale, double value)
{
    return MECHC_SMALL_MOVE * mechc_max(scale, MECHC_LARGE_VALUE * fabs(value));
}

/* Report a stage to statistics and monitor. */
MECHC_STATIC void mechc_meet(mechc_integration *run, double t, const double *y, double singular)
{
    mechc_stats *stats = &run->head.stats;
    if (MECHC_NC == 0) return;
    if (singular < stats->least_singular) {
        stats->least_singular = singular;
        stats->least_singular_time = t;
    }
    run->conditioning = singular;
    mechc_monitor_meet(&run->monitor, singular, y);
}

/* The reason why rates are not finite: where constraints are solved in their free directions, the
 * mass matrix is factored only here. */
MECHC_RARE_ONCE int mechc_not_finite(const mechc_scalar_place *place, mechc_stats *stats)
{
#if MECHC_FREE_TREE
    for (int i = 0; i < MECHC_AT_SAVED; i++)
        if (!(fabs(place->saved[i]) < HUGE_VAL)) return MECHC_NOT_FINITE;
    stats->coordinate = place->bad;
#else
    mechc_scalar_mass_factors unused;
    const double *mass = place->mass;
#if MECHC_WALKED
    double written_out[MECHC_NU_MAX * MECHC_NU_MAX];
    mechc_scalar_composite_mass(place->saved, written_out);
    mass = written_out;
#endif
    for (int i = 0; i < MECHC_NU * MECHC_NU; i++)
        if (!(fabs(mass[i]) < HUGE_VAL)) return MECHC_NOT_FINITE;
    stats->coordinate = mechc_scalar_factor_mass(mass, MECHC_NU, &unused);
#endif
    return stats->coordinate >= 0 ? MECHC_SINGULAR_MASS : MECHC_NOT_FINITE;
}

#if MECHC_HAS(DRIVER)
MECHC_RARE double mechc_conditioning_at(const mechc_integration *run, double t, const double *q);

/* Rates by functions of the caller. */
MECHC_RARE int mechc_outer_rates(mechc_integration *run, double t, double *y, double *rates)
{
    run->head.stats.rhs_evaluations++;
    const int status = run->outer->rates(run->outer->owner, t, y, rates);
    if (status != MECHC_RUNNING) return status;
    if (MECHC_NH > 0) mechc_meet(run, t, y, mechc_conditioning_at(run, t, y));
    for (int i = 0; i < MECHC_NX; i++)
        if (!(fabs(rates[i]) < HUGE_VAL)) return MECHC_NOT_FINITE;
    return MECHC_RUNNING;
}

/* Project y onto the constraints and take its rates. */
MECHC_ONCE int mechc_rates_at(mechc_integration *run, double t, double *y, double *rates)
{
    mechc_scalar_place place;
    mechc_stats *stats = &run->head.stats;
    if (mechc_scalar_stopped(&run->given)) return MECHC_INTERRUPTED;
    if (run->outer) return mechc_outer_rates(run, t, y, rates);
    const int status =
        mechc_scalar_close_loops(t, y, &run->given, &place, &stats->closure_iterations);
    stats->rhs_evaluations++;
    if (status != MECHC_RUNNING) {
        stats->coordinate = place.bad;
        return status;
    }
    const double conditioning = mechc_conditioning(run, &place);
    if (mechc_is_fine(conditioning * conditioning) && mechc_knows_crossing(&run->monitor))
        mechc_close_finely(t, y, &run->given, &run->monitor.known, conditioning, &place);
    mechc_scalar_steady(&place, y + MECHC_NQ);
    mechc_scalar_coordinate_rates_of(t, y, y + MECHC_NQ, &run->given, rates);
    mechc_scalar_accelerate(t, y, y + MECHC_NQ, &run->given, &place, rates + MECHC_NQ, 0);
    mechc_meet(run, t, y, conditioning);
    for (int i = 0; i < MECHC_NX; i++)
        if (!(fabs(rates[i]) < HUGE_VAL)) return mechc_not_finite(&place, stats);
    return MECHC_RUNNING;
}

/* The conditioning of the configuration rows at a configuration, whichever rows are redundant. */
MECHC_ONCE double mechc_conditioning_at(const mechc_integration *run, double t, const double *q)
{
#if MECHC_NH_MAX > 0
    mechc_weakest weakest;
    mechc_weakest_at(t, q, &run->given, run->monitor.rank, &weakest);
    return weakest.ratio;
#else
    (void)run, (void)t, (void)q;
    return 1.0;
#endif
}
#else
MECHC_INLINE int mechc_rates_at(mechc_integration *run, double t, double *y, double *rates)
{
    return run->driver->rates_at(run, t, y, rates);
}

MECHC_INLINE double mechc_conditioning_at(const mechc_integration *run, double t, const double *q)
{
    return run->driver->conditioning(run, t, q);
}
#endif

#if MECHC_NH_MAX > 0
/* How far the coordinates move, over their scales, to where rates are taken for a state that is too
 * near a crossing to have any. */
#define MECHC_ASIDE 1e-2
/* Of the fastest coordinate: how far rates change over that way on a branch; on none they change by as much
 * as themselves. */
#define MECHC_SAME_BRANCH 0.2

/* Close the loops of a state so near a crossing that its speeds decide about the weakest row. */
MECHC_RARE int mechc_close_beside(mechc_integration *run, double t, double *y)
{
    double closed[MECHC_NX_MAX], unused[MECHC_NX_MAX];
    memcpy(closed, y, MECHC_NX * sizeof *y);
    const int status = mechc_rates_at(run, t, closed, unused);
    const double square = run->conditioning * run->conditioning;
    if (status != MECHC_RUNNING || !mechc_is_fine(square) || !mechc_knows_crossing(&run->monitor))
        return mechc_project_between(t, y, &run->given);
    memcpy(y, closed, MECHC_NQ * sizeof *y);
    mechc_keep_weakest_rate(t, y, &run->given);
    return MECHC_RUNNING;
}

/* Rates of a first or last state so near a crossing that rows turned by its rounding would decide about its
 * speeds: these are kept, and q is closed beyond the rounding of doubles, or moved within it until they fit.
 * The accelerations are those a little farther on (`way` 1) or back (-1) in the run: steps of collocation,
 * which begin or end there, take no rates at their ends, and begin their iteration with these.  Where they
 * follow no branch: MECHC_NOT_CLOSED. */
MECHC_RARE int mechc_rates_beside(mechc_integration *run, double t, double way,
                                  const double *scale, double *y, double *rates)
{
    const double conditioning = run->conditioning;
    double moved[MECHC_NX_MAX], fastest = 0.0;
    int status = mechc_close_beside(run, t, y);
    if (status != MECHC_RUNNING) return status;
    mechc_scalar_coordinate_rates_of(t, y, y + MECHC_NQ, &run->given, rates);
    for (int i = 0; i < MECHC_NQ; i++) fastest = mechc_max(fastest, fabs(rates[i]) / scale[i]);
    const double by = way * run->direction * MECHC_ASIDE / fastest;
    if (!(fabs(by) < HUGE_VAL)) return MECHC_NOT_CLOSED;
    memcpy(moved, y, MECHC_NX * sizeof *y);
    for (int i = 0; i < MECHC_NQ; i++) moved[i] += by * rates[i];
    double beside[MECHC_NX_MAX];
    status = mechc_rates_at(run, t + by, moved, beside);
    for (int i = 0; i < MECHC_NQ; i++)
        if (!(fabs(beside[i] - rates[i]) <= MECHC_SAME_BRANCH * fastest * scale[i])) return MECHC_NOT_CLOSED;
    memcpy(rates + MECHC_NQ, beside + MECHC_NQ, MECHC_NU * sizeof *rates);
    run->conditioning = conditioning;
    return status;
}
#endif
