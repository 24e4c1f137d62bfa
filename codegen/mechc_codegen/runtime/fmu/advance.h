/* Initialization: values are set, then loops are closed.  Co-simulation: motion to a communication
 * point by mechc's own integrators. */
#pragma once

#include "fmu/events.h"

#define MECHC_FMU_MOST_STEPS 10000000

MECHC_STATIC void mechc_fmu_set_options(mechc_fmu *fmu)
{
    const int method = mechc_fmu_scene.method;
    fmu->reacher.options = (mechc_options){
        .p = fmu->now.p, .rtol = fmu->now.rtol, .max_step = HUGE_VAL, .max_steps = MECHC_FMU_MOST_STEPS,
        .method = method, .dense = fmu->reacher.ahead, .on_change_point = MECHC_CONTINUE_STRAIGHT,
        .when_stiff = MECHC_RADAU5,
    };
}

/* Begin the motion of co-simulation at the present state. */
MECHC_STATIC void mechc_fmu_go_from_now(mechc_fmu *fmu)
{
    mechc_fmu_set_options(fmu);
    mechc_reach_from(&fmu->reacher, fmu->now.t, fmu->now.y);
    fmu->moved = 0;
}

/* Begin initialization at t0; tolerance 0: that of the unit. */
MECHC_STATIC mechc_fmu_status mechc_fmu_initialise(mechc_fmu *fmu, double t0, double tolerance)
{
    fmu->now.t = t0;
    if (tolerance > 0.0) fmu->now.rtol = tolerance;
    fmu->moved = fmu->given_parameters = 1;
    fmu->evaluated = 0;
    return MECHC_FMU_OK;
}

/* End initialization: close the loops at the nearest state. */
MECHC_STATIC mechc_fmu_status mechc_fmu_begin(mechc_fmu *fmu)
{
    mechc_fmu_current(fmu);
    if (!mechc_all_finite(fmu->now.p, MECHC_NP))
        return mechc_fmu_fails(fmu, "a parameter has no value");
    if (mechc_fmu_close(fmu) != MECHC_RUNNING)
        return mechc_fmu_fails(fmu, "the loops cannot be closed near the start values: with "
                                    "these parameters the links may not reach. Set others, or "
                                    "start values near which the loops close");
    mechc_fmu_go_from_now(fmu);
    mechc_fmu_take_sides(fmu);
    return MECHC_FMU_OK;
}

#define MECHC_FMU_TIME 1e-9 /* of a step and of the time: an importer adds up times so exactly */

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
        {MECHC_EVENT_FAILED, "an event, its reset or the law of a contact has no finite value"},
        {MECHC_OPEN_AT_START, "parts overlap: the gap of a stop is negative"},
        {MECHC_CONTACT_INCONSISTENT, "no motion satisfies the laws of contact"},
        {MECHC_CONTACT_UNDECIDED, "the laws of contact admit several motions"},
        {MECHC_CONTACTS_TOO_MANY, "too many contacts may stick at once"},
        {MECHC_AT_CHANGE_POINT, "the state is a change point, from which two ways lead on"},
    };
    for (size_t i = 0; i < sizeof told / sizeof told[0]; i++)
        if (told[i].status == status) return mechc_fmu_fails(fmu, told[i].words);
    return mechc_fmu_fails(fmu, "the motion through a change point is not determined");
}

/* Advance by h from the present time. */
MECHC_STATIC mechc_fmu_status mechc_fmu_step(mechc_fmu *fmu, double t, double h)
{
    const double t1 = t + h;
    if (!(h > 0.0)) return h == 0.0 ? MECHC_FMU_OK : mechc_fmu_fails(fmu, "a step goes forward");
    if (fabs(t - fmu->now.t) > MECHC_FMU_TIME * (h + fabs(t)))
        return mechc_fmu_fails(fmu, "a step begins where the last one ended");
    mechc_fmu_set_options(fmu);
    if (fmu->moved) { /* a state or parameters were set */
        if (mechc_fmu_close(fmu) != MECHC_RUNNING) return mechc_fmu_ended(fmu, MECHC_NOT_CLOSED);
        mechc_fmu_go_from_now(fmu);
    }
    const int status = mechc_reach_time(&fmu->reacher, t1, fmu->driven);
    fmu->evaluated = 0;
    if (status != MECHC_RUNNING && status != MECHC_FINISHED) return mechc_fmu_ended(fmu, status);
    memcpy(fmu->now.y, fmu->reached, MECHC_NX * sizeof *fmu->reached);
    fmu->now.t = t1;
    fmu->driven = 0;
    return MECHC_FMU_OK;
}
