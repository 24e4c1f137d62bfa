/* Model exchange: the importer integrates coordinates and speeds; loops that drift open are closed
 * in event mode, where FMI lets a unit change its states. */
#pragma once

#include "fmu/events.h"

/* The distance to the nearest state on the constraints, divided by the scale of each component. */
MECHC_STATIC double mechc_fmu_drift(mechc_fmu *fmu)
{
    double y[MECHC_NX_MAX], farthest = 0.0;
    memcpy(y, fmu->now.y, MECHC_NX * sizeof *y);
    if (mechc_standalone_project(mechc_fmu_current(fmu), fmu->now.t, y) != MECHC_RUNNING)
        return HUGE_VAL;
    const double *scale = mechc_fmu_motion(fmu)->scale;
    for (int i = 0; i < MECHC_NX; i++)
        farthest = mechc_max(farthest, fabs(y[i] - fmu->now.y[i]) / scale[i]);
    return farthest;
}

/* Whether the loops have to be closed in event mode. */
MECHC_STATIC int mechc_fmu_has_drifted(mechc_fmu *fmu)
{
    return MECHC_NC > 0 && fmu->now.drift > 0.0 && mechc_fmu_drift(fmu) > fmu->now.drift;
}

/* Close loops that drifted open or whose values were set; tells whether a state changed. */
MECHC_STATIC mechc_fmu_status mechc_fmu_close_again(mechc_fmu *fmu, int *changed)
{
    const int asked = fmu->moved || mechc_fmu_has_drifted(fmu);
    double before[MECHC_NX_MAX];
    *changed = 0;
    if (MECHC_NC == 0 || !asked) return MECHC_FMU_OK;
    memcpy(before, fmu->now.y, MECHC_NX * sizeof *before);
    if (mechc_fmu_close(fmu) != MECHC_RUNNING)
        return mechc_fmu_fails(fmu, "the loops cannot be closed near this state");
    fmu->moved = 0;
    *changed = memcmp(before, fmu->now.y, MECHC_NX * sizeof *before) != 0;
    return MECHC_FMU_OK;
}

/* Event mode: close loops and reset events; tells whether a state changed, and whether the motion
 * ends. */
MECHC_STATIC mechc_fmu_status mechc_fmu_update(mechc_fmu *fmu, int *changed, int *ends)
{
    const mechc_fmu_status status = mechc_fmu_close_again(fmu, changed);
    *ends = 0;
    int reset = 0;
    if (status != MECHC_FMU_OK) return status;
    const int crossed = mechc_fmu_cross(fmu, &reset);
    *changed |= reset;
    *ends = crossed == MECHC_RESETS_ACCUMULATE;
    if (crossed != MECHC_RUNNING && !*ends)
        return mechc_fmu_fails(fmu, "an event or its reset has no finite value");
    return status;
}
