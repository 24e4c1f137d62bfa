/* The change of method where stability and not accuracy limits the steps: to the implicit one on trial.
 *
 * Its order is lower: where a motion is followed to many digits it may need more steps than stability
 * does.  So its first steps are compared with those before it, by how far the same work leads; if it
 * is slower the method before continues, and the next trial is after twice as many steps.
 */
#pragma once

#include "run/method.h"

#define MECHC_STIFF 15 /* such steps, with fewer than MECHC_EASY others in a row between */
#define MECHC_EASY 6
#define MECHC_TRIAL 16     /* steps of the implicit method */
#define MECHC_TRIAL_GROWS 4 /* the first of them, which do not count: they still grow */

/* |h lambda| beyond which a step is short for the sake of a fast component: stability bears no more, or errors
 * shrink by a lower order, so that accuracy asks for steps much shorter than the motion does; the second
 * is not known where steps follow the user's own tolerances. */
MECHC_STATIC double mechc_stiff_bound(const mechc_integration *run, const mechc_tableau *tableau)
{
    const double fast = run->has_tolerances ? 0.0 : tableau->fast * pow(run->rtol, 1.0 / tableau->order);
    return fast > 0.0 && fast < tableau->stability ? fast : tableau->stability;
}

/* Begin measuring the pace at the end of this step. */
MECHC_STATIC void mechc_start_pace(mechc_integration *run, double h)
{
    run->pace_t = run->head.t + h;
    run->pace_rhs = run->head.stats.rhs_evaluations;
}

/* The progress per unit of work since then, to the end of this step: over the rates of a single state an
 * evaluation of collocation, a lane of a vector, costs about
 * two lanes' part, of four: the choice does not depend on how many there are. */
MECHC_STATIC double mechc_pace(const mechc_integration *run, double h)
{
    const double made = (double)(run->head.stats.rhs_evaluations - run->pace_rhs);
    const double work = run->method->number == MECHC_GAUSS8 ? 0.5 : 1.0;
    return fabs(run->head.t + h - run->pace_t) / (made * work);
}

/* Count an accepted step. */
MECHC_STATIC void mechc_watch_stiffness(mechc_integration *run, double h, const double *end,
                                        double error)
{
    const mechc_method *method = run->method;
    if (!run->when_stiff || run->current != method) return;
    if (run->trial > 0 && method->number == MECHC_RADAU5) { /* at its end the slower method is dropped */
        run->trial--;
        if (run->trial == MECHC_TRIAL - MECHC_TRIAL_GROWS) mechc_start_pace(run, h);
        if (run->trial == 0 && mechc_pace(run, h) < run->pace) run->goes_back = 1;
    }
    if (!method->limited) return;
    if (MECHC_NH > 0 && run->monitor.first < MECHC_NARROW) return;
    const int limited = method->limited(run, h, end, error);
    run->stiff = limited ? run->stiff + 1 : run->stiff;
    run->easy = limited ? 0 : run->easy + 1;
    if (run->stiff == 1 && limited) mechc_start_pace(run, h);
    if (run->easy >= MECHC_EASY) run->stiff = 0;
}

/* The method that takes over: the implicit one from that which takes over from the others. */
MECHC_STATIC const mechc_method *mechc_for_stiff(const mechc_integration *run)
{
    const mechc_method *method = run->methods[run->when_stiff];
    return run->method == method ? run->methods[MECHC_RADAU5] : method;
}

/* Whether a run of members that meets critical configurations continues by collocation: each step beside one is
 * examined, and collocation takes the fewest.  Bends are left to the pair. */
MECHC_STATIC int mechc_leaves_pair(const mechc_integration *run)
{
    return run->when_stiff == MECHC_GAUSS8 && run->method->number == MECHC_DOP853 && !run->resumed
        && run->head.stats.critical_gap < HUGE_VAL;
}

/* Begin a trial of the implicit method, or end one that it has lost; 0 without memory. */
MECHC_STATIC int mechc_change_method(mechc_integration *run)
{
    const int back = run->goes_back;
    run->goes_back = 0;
    if (back) return mechc_use_method(run, run->methods[run->left->number]);
    if (run->stiff < MECHC_STIFF << run->trials && !mechc_leaves_pair(run)) return 1;
    const mechc_method *next = mechc_for_stiff(run);
    if (next->number == MECHC_RADAU5) {
        run->pace = mechc_pace(run, 0.0);
        run->left = run->method;
        run->trial = MECHC_TRIAL;
        run->trials = run->trials < 8 ? run->trials + 1 : run->trials;
        run->stiff = 0;
    } else run->alone = 1; /* as a run from lockstep: collocation begins with Newton's iteration */
    return mechc_use_method(run, next);
}
