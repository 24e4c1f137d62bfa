/* Initialization of a unit: values are set, then loops are closed. */
#pragma once

#include "fmu/events.h"

#define MECHC_FMU_MOST_STEPS 10000000

MECHC_STATIC void mechc_fmu_set_options(mechc_fmu *fmu)
{
    const int method = mechc_fmu_scene.method;
    fmu->reacher.options = (mechc_options){
        .p = fmu->now.p, .rtol = fmu->now.rtol, .max_step = HUGE_VAL, .max_steps = MECHC_FMU_MOST_STEPS,
        .method = method, .dense = fmu->reacher.ahead, .on_change_point = MECHC_CONTINUE_STRAIGHT,
        .may_stiffen = 1,
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
        return mechc_fmu_fails(fmu, "the loops cannot be closed near the start values");
    mechc_fmu_go_from_now(fmu);
    mechc_fmu_take_sides(fmu);
    return MECHC_FMU_OK;
}
