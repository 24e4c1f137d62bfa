/* Model exchange: the importer integrates coordinates and speeds; loops that drift open are closed
 * in event mode, where FMI lets a unit change its states. */
#pragma once

#include "fmu/events.h"

MECHC_STATIC void mechc_fmu_set_time(mechc_fmu *fmu, double t)
{
    if (fmu->now.t == t) return;
    fmu->now.t = t;
    fmu->evaluated = 0;
}

MECHC_STATIC mechc_fmu_status mechc_fmu_set_states(mechc_fmu *fmu, const double *y, size_t count)
{
    if (count != MECHC_NX) return mechc_fmu_fails(fmu, "this is not the number of states");
    memcpy(fmu->now.y, y, sizeof fmu->now.y);
    fmu->evaluated = 0;
    return MECHC_FMU_OK;
}

MECHC_STATIC mechc_fmu_status mechc_fmu_states(const mechc_fmu *fmu, double *y, size_t count)
{
    if (count != MECHC_NX) return mechc_fmu_fails(fmu, "this is not the number of states");
    memcpy(y, fmu->now.y, sizeof fmu->now.y);
    return MECHC_FMU_OK;
}

MECHC_STATIC mechc_fmu_status mechc_fmu_nominals(mechc_fmu *fmu, double *nominals, size_t count)
{
    if (count != MECHC_NX) return mechc_fmu_fails(fmu, "this is not the number of states");
    memcpy(nominals, mechc_fmu_motion(fmu)->scale, count * sizeof *nominals);
    return MECHC_FMU_OK;
}

/* The rates of the state.  If no motion exists at a trial step of the importer, it has to try a
 * shorter one. */
MECHC_STATIC mechc_fmu_status mechc_fmu_rates(mechc_fmu *fmu, double *rates, size_t count)
{
    if (count != MECHC_NX) return mechc_fmu_fails(fmu, "this is not the number of states");
    mechc_fmu_evaluate(fmu);
    memcpy(rates, fmu->rates, sizeof fmu->rates);
    return mechc_all_finite(rates, MECHC_NX) ? MECHC_FMU_OK : MECHC_FMU_DISCARD;
}

/* The distance to the nearest state on the constraints, divided by the scale of each component. */
MECHC_STATIC double mechc_fmu_drift(mechc_fmu *fmu)
{
    double y[MECHC_NX], farthest = 0.0;
    memcpy(y, fmu->now.y, sizeof y);
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

/* Whether event mode is needed after a completed step of the importer. */
MECHC_STATIC int mechc_fmu_asks_for_event(mechc_fmu *fmu)
{
    return mechc_fmu_has_drifted(fmu) || mechc_fmu_missed(fmu);
}

MECHC_STATIC mechc_fmu_status mechc_fmu_indicators(mechc_fmu *fmu, double *values, size_t count)
{
    if (count != MECHC_FMU_EVENTS)
        return mechc_fmu_fails(fmu, "this is not the number of event indicators");
    mechc_fmu_evaluate(fmu);
    if (MECHC_FMU_EVENTS > 0) memcpy(values, fmu->indicators, count * sizeof *values);
    return MECHC_FMU_OK;
}

/* Close loops that drifted open or whose values were set; tells whether a state changed. */
MECHC_STATIC mechc_fmu_status mechc_fmu_close_again(mechc_fmu *fmu, int *changed)
{
    const int asked = fmu->moved || mechc_fmu_has_drifted(fmu);
    double before[MECHC_NX];
    *changed = 0;
    if (MECHC_NC == 0 || !asked) return MECHC_FMU_OK;
    memcpy(before, fmu->now.y, sizeof before);
    if (mechc_fmu_close(fmu) != MECHC_RUNNING)
        return mechc_fmu_fails(fmu, "the loops cannot be closed near this state");
    fmu->moved = 0;
    *changed = memcmp(before, fmu->now.y, sizeof before) != 0;
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
