/* The functions of FMI 2.0 that importers call, based on those that both versions share.
 *
 * Source of the interface: Functional Mock-up Interface for Model Exchange and Co-Simulation,
 * version 2.0.4, sections 2 to 4. */
#pragma once

#include "fmu/names2.h"
#include "fmu/interface.h"

typedef struct {
    mechc_fmi_log *log;
    void *(*allocate)(size_t count, size_t size);
    void (*release)(void *memory);
    void (*finished)(void *environment, int status);
    void *environment;
} mechc_fmi2_callbacks;

typedef struct {
    int again, terminate, nominals_changed, states_changed, event_defined;
    double event;
} mechc_fmi2_event;

MECHC_EXPORTED const char *fmi2GetTypesPlatform(void) { return "default"; }
MECHC_EXPORTED const char *fmi2GetVersion(void) { return "2.0"; }

MECHC_EXPORTED void *fmi2Instantiate(const char *name, int type, const char *token,
                                     const char *resources, const mechc_fmi2_callbacks *callbacks,
                                     int visible, int logging)
{
    return mechc_fmi_make(name, token, callbacks ? callbacks->environment : 0,
                          callbacks ? callbacks->log : 0);
}

MECHC_FMI(SetupExperiment)(mechc_fmu *fmu, int tolerance_defined, double tolerance, double t0,
                           int end_defined, double end)
{
    return (int)mechc_fmu_initialise(fmu, t0, tolerance_defined ? tolerance : 0.0);
}

MECHC_FMI_ENTERS(EnterInitializationMode)
MECHC_FMI_NO_TYPE(Integer, int)

MECHC_FMI(NewDiscreteStates)(mechc_fmu *fmu, mechc_fmi2_event *event)
{
    memset(event, 0, sizeof *event);
    return (int)mechc_fmu_update(fmu, &event->states_changed, &event->terminate);
}

/* Co-simulation. */

MECHC_FMI(DoStep)(mechc_fmu *fmu, double t, double h, int no_way_back)
{
    return (int)mechc_fmu_step(fmu, t, h);
}

MECHC_FMI_REFUSES(CancelStep, "steps are not taken in the background", mechc_fmu *fmu)

MECHC_FMI_NONE(SetRealInputDerivatives, const int *orders, const double *values)
MECHC_FMI_NONE(GetRealOutputDerivatives, const int *orders, double *values)

MECHC_FMI(GetRealStatus)(mechc_fmu *fmu, int kind, double *value)
{
    enum { LAST_SUCCESSFUL_TIME = 2 };
    if (kind != LAST_SUCCESSFUL_TIME) return MECHC_FMU_DISCARD;
    *value = fmu->now.t;
    return MECHC_FMU_OK;
}

#define MECHC_FMI2_NO_STATUS(name, type) \
    MECHC_FMI(name)(mechc_fmu *fmu, int kind, type *value) { return MECHC_FMU_DISCARD; }
MECHC_FMI2_NO_STATUS(GetStatus, int)
MECHC_FMI2_NO_STATUS(GetIntegerStatus, int)
MECHC_FMI2_NO_STATUS(GetBooleanStatus, int)
MECHC_FMI2_NO_STATUS(GetStringStatus, const char *)
