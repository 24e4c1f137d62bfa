/* Co-simulation: the motion on to a communication point by mechc's own integrators.
 *
 * As mechc.Stepper does: a mechanism without loops is integrated up to the point; one with loops in
 * steps of their own length beyond it, where its dense output is read, since no step should end near
 * a change point. */
#pragma once

#include <limits.h>
#include "fmu/events.h"

#define MECHC_FMU_AHEAD 100.0 /* s that a run may go on before it begins again; or */
#define MECHC_FMU_STEPS_AHEAD 1000.0 /* communication steps */
#define MECHC_FMU_MOST_STEPS 10000000

MECHC_STATIC mechc_fmu_status mechc_fmu_ended(const mechc_fmu *fmu, int status)
{
    static const struct {
        int status;
        const char *words;
    } told[] = {
        {MECHC_NOT_CLOSED, "the loops cannot be closed near this state"},
        {MECHC_STEP_TOO_SMALL, "the integrator's step shrank to nothing"},
        {MECHC_NOT_FINITE, "a value is NaN or infinite"},
        {MECHC_SINGULAR_MASS, "the mass matrix is singular"},
        {MECHC_TOO_MANY_STEPS, "too many steps of the integrator"},
        {MECHC_NO_MEMORY, "no memory"},
        {MECHC_RESETS_ACCUMULATE, "resets follow each other ever faster"},
        {MECHC_EVENT_FAILED, "an event or its reset has no finite value"},
        {MECHC_AT_CHANGE_POINT, "the state is a change point, from which two ways lead on"},
    };
    for (size_t i = 0; i < sizeof told / sizeof told[0]; i++)
        if (told[i].status == status) return mechc_fmu_fails(fmu, told[i].words);
    return mechc_fmu_fails(fmu, "the motion through a change point is not determined");
}

MECHC_STATIC int mechc_fmu_start(mechc_fmu *fmu, double t1, int method)
{
    double scale[MECHC_NX];
    mechc_fmu_scale(fmu, scale);
    mechc_fmu_drop_run(fmu);
    fmu->run = calloc(1, sizeof(mechc_integration));
    if (!fmu->run) return MECHC_NO_MEMORY;
    const mechc_options options = {
        .t0 = fmu->now.t, .t1 = t1, .y0 = fmu->now.y, .p = fmu->now.p,
        .inputs = MECHC_NI > 0 ? &fmu->held.head : 0,
        .rtol = fmu->now.rtol, .scale = scale, .max_step = HUGE_VAL,
        .max_steps = MECHC_FMU_MOST_STEPS, .method = method, .dense = MECHC_NH > 0 || MECHC_FMU_RESETS,
        .on_change_point = MECHC_CONTINUE_STRAIGHT,
        .may_stiffen = method == mechc_fmu_scene.method,
    };
    mechc_unit_start(fmu->run, &options);
#if MECHC_FMU_RESETS
    mechc_fmu_watch_run(fmu);
#endif
    return fmu->run->status;
}

MECHC_STATIC const double *mechc_fmu_last_state(const mechc_run *run)
{
    return run->trajectory.y + (run->trajectory.count - 1) * MECHC_NX;
}

/* Keep of the record the last state only; count steps from zero. */
MECHC_STATIC void mechc_fmu_forget(mechc_run *run)
{
    mechc_trajectory *record = &run->trajectory;
    if (record->count > 1) {
        record->t[0] = record->t[record->count - 1];
        memmove(record->y, mechc_fmu_last_state(run), MECHC_NX * sizeof(double));
        record->count = 1;
    }
    record->crossing_count = 0;
    run->stats.steps = run->stats.rejected = 0;
}

MECHC_STATIC int mechc_fmu_advance(mechc_run *run, long steps)
{
    return MECHC_UNIT_TABLE.advance(run, steps);
}

#if MECHC_NH == 0 && !MECHC_FMU_RESETS
/* Up to the point itself. */
MECHC_STATIC int mechc_fmu_reach(mechc_fmu *fmu, double t1)
{
    if (!fmu->run) {
        const int status = mechc_fmu_start(fmu, t1, mechc_fmu_scene.method);
        if (status != MECHC_RUNNING && status != MECHC_FINISHED) return status;
    } else {
        mechc_fmu_forget(fmu->run);
        mechc_integration_extend(fmu->run, t1, fmu->driven && MECHC_NI > 0 ? &fmu->held.head : 0);
    }
    while (fmu->run->status == MECHC_RUNNING) mechc_fmu_advance(fmu->run, LONG_MAX);
    if (fmu->run->status != MECHC_FINISHED) return fmu->run->status;
    memcpy(fmu->now.y, mechc_fmu_last_state(fmu->run), sizeof fmu->now.y);
    return MECHC_RUNNING;
}
#else
/* Beside change points another method steps more surely. */
MECHC_STATIC int mechc_fmu_is_beside(int status)
{
    return status == MECHC_UNDECIDED || status == MECHC_NO_STEP_FITS
        || status == MECHC_BRANCH_IN_DOUBT || status == MECHC_BEND_TOO_SHARP
        || status == MECHC_STEP_TOO_SMALL;
}

#if MECHC_FMU_RESETS
#define MECHC_FMU_STOP(fmu) ((fmu)->stop)
#else
#define MECHC_FMU_STOP(fmu) HUGE_VAL
#endif

/* The end of the last step, or a reset within it. */
MECHC_STATIC double mechc_fmu_end(const mechc_fmu *fmu)
{
    return mechc_min(fmu->run->t, MECHC_FMU_STOP(fmu));
}

/* Steps of the run's own lengths until it has reached t1 or passed it, or a reset. */
MECHC_STATIC int mechc_fmu_run_to(mechc_fmu *fmu, double t1)
{
    mechc_run *run = fmu->run;
    if (run->t >= t1 || mechc_fmu_end(fmu) < run->t) return run->status;
    mechc_fmu_forget(run);
#if MECHC_FMU_RESETS
    fmu->looked = 0;
#endif
    while (run->status == MECHC_RUNNING && mechc_fmu_end(fmu) == run->t && run->t < t1) {
        mechc_fmu_advance(run, 1);
#if MECHC_FMU_RESETS
        const int status = mechc_fmu_look(fmu);
        if (status != MECHC_RUNNING) return status;
#endif
    }
    return run->status;
}

/* Where a run that did not reach t1 has come to: the end of its last step, or after a reset. */
MECHC_STATIC int mechc_fmu_take_end(mechc_fmu *fmu)
{
#if MECHC_FMU_RESETS
    if (fmu->stop <= fmu->run->t) return mechc_fmu_reset_at_stop(fmu);
#endif
    fmu->now.t = fmu->run->t;
    memcpy(fmu->now.y, mechc_fmu_last_state(fmu->run), sizeof fmu->now.y);
    return MECHC_RUNNING;
}

MECHC_STATIC int mechc_fmu_reach(mechc_fmu *fmu, double t1)
{
    const int first = mechc_fmu_scene.method;
    const double ahead = mechc_max(MECHC_FMU_AHEAD, MECHC_FMU_STEPS_AHEAD * (t1 - fmu->now.t));
    int method = first;
    if (fmu->driven) mechc_fmu_drop_run(fmu);
    while (!fmu->run || mechc_fmu_end(fmu) < t1) {
        if (!fmu->run) mechc_fmu_start(fmu, fmu->now.t + ahead, method);
        if (!fmu->run) return MECHC_NO_MEMORY;
        const int status = mechc_fmu_run_to(fmu, t1);
        if (mechc_fmu_end(fmu) >= t1) break;
        const int beside = mechc_fmu_is_beside(status) && method != MECHC_DOP853;
        if (status != MECHC_RUNNING && status != MECHC_FINISHED && !beside) return status;
        method = beside ? MECHC_DOP853 : first;
        const int taken = mechc_fmu_take_end(fmu);
        mechc_fmu_drop_run(fmu);
        if (taken != MECHC_RUNNING) return taken;
    }
    mechc_interpolate(&fmu->run->trajectory, fmu->now.p, MECHC_NI > 0 ? &fmu->held.head : 0, 1,
                      &t1, fmu->now.y);
    return MECHC_RUNNING;
}
#endif

/* From the present time on by h. */
MECHC_STATIC mechc_fmu_status mechc_fmu_step(mechc_fmu *fmu, double t, double h)
{
    const double t1 = t + h;
    if (!(h > 0.0)) return h == 0.0 ? MECHC_FMU_OK : mechc_fmu_fails(fmu, "a step goes forward");
    if (fabs(t - fmu->now.t) > 1e-9 * (h + fabs(t)))
        return mechc_fmu_fails(fmu, "a step begins where the last one ended");
    if (fmu->moved) {
        mechc_fmu_drop_run(fmu);
        if (mechc_fmu_close(fmu) != MECHC_RUNNING) return mechc_fmu_ended(fmu, MECHC_NOT_CLOSED);
    }
    const int status = mechc_fmu_reach(fmu, t1);
    fmu->evaluated = 0;
    if (status != MECHC_RUNNING) return mechc_fmu_ended(fmu, status);
    fmu->now.t = t1;
    fmu->moved = fmu->driven = 0;
    return MECHC_FMU_OK;
}
