/* The functions of FMI 3.0 that importers call, based on those that both versions share.
 *
 * Source of the interface: Functional Mock-up Interface Specification, version 3.0.2, sections 2 to
 * 4. */
#pragma once

#include "fmu/names3.h"
#include "fmu/interface.h"

MECHC_EXPORTED const char *fmi3GetVersion(void) { return "3.0"; }

MECHC_EXPORTED void *fmi3InstantiateModelExchange(const char *name, const char *token,
                                                  const char *resources, bool visible, bool logging,
                                                  void *environment, mechc_fmi_log *log)
{
    return mechc_fmi_make(name, token, environment, log);
}

/* Create an instance; NULL if the importer wants events in co-simulation, which the description excludes. */
MECHC_EXPORTED void *fmi3InstantiateCoSimulation(
    const char *name, const char *token, const char *resources, bool visible, bool logging,
    bool events, bool early, const uint32_t *required, size_t required_count, void *environment,
    mechc_fmi_log *log, void (*intermediate)(void))
{
    return events ? 0 : mechc_fmi_make(name, token, environment, log);
}

MECHC_EXPORTED void *fmi3InstantiateScheduledExecution(
    const char *name, const char *token, const char *resources, bool visible, bool logging,
    void *environment, mechc_fmi_log *log, void (*clock)(void), void (*lock)(void),
    void (*unlock)(void))
{
    return 0;
}

MECHC_FMI(EnterInitializationMode)(mechc_fmu *fmu, bool tolerance_defined, double tolerance,
                                   double t0, bool end_defined, double end)
{
    return (int)mechc_fmu_initialise(fmu, t0, tolerance_defined ? tolerance : 0.0);
}

MECHC_FMI_NO_TYPE(Float32, float)
MECHC_FMI_NO_TYPE(Int8, int8_t)
MECHC_FMI_NO_TYPE(UInt8, uint8_t)
MECHC_FMI_NO_TYPE(Int16, int16_t)
MECHC_FMI_NO_TYPE(UInt16, uint16_t)
MECHC_FMI_NO_TYPE(Int32, int32_t)
MECHC_FMI_NO_TYPE(UInt32, uint32_t)
MECHC_FMI_NO_TYPE(Int64, int64_t)
MECHC_FMI_NO_TYPE(UInt64, uint64_t)
MECHC_FMI_NONE(GetBinary, size_t *sizes, const uint8_t **values, size_t size)
MECHC_FMI_NONE(SetBinary, const size_t *sizes, const uint8_t *const *values, size_t size)

/* Functions for clocks and arrays of variable size, which this unit lacks. */
MECHC_FMI_NONE(GetClock, bool *ticks)
MECHC_FMI_NONE(SetClock, const bool *ticks)
MECHC_FMI_NONE(GetIntervalDecimal, double *intervals, int *kinds)
MECHC_FMI_NONE(GetIntervalFraction, uint64_t *counters, uint64_t *resolutions, int *kinds)
MECHC_FMI_NONE(GetShiftDecimal, double *shifts)
MECHC_FMI_NONE(GetShiftFraction, uint64_t *counters, uint64_t *resolutions)
MECHC_FMI_NONE(SetIntervalDecimal, const double *intervals)
MECHC_FMI_NONE(SetIntervalFraction, const uint64_t *counters, const uint64_t *resolutions)
MECHC_FMI_NONE(SetShiftDecimal, const double *shifts)
MECHC_FMI_NONE(SetShiftFraction, const uint64_t *counters, const uint64_t *resolutions)
MECHC_FMI_NONE(GetOutputDerivatives, const int32_t *orders, double *values, size_t size)
MECHC_FMI_REFUSES(ActivateModelPartition, "there are no clocks", mechc_fmu *fmu, uint32_t clock, double t)
MECHC_FMI_REFUSES(GetNumberOfVariableDependencies, "dependencies are not told by element",
                  mechc_fmu *fmu, uint32_t reference, size_t *count)
MECHC_FMI_REFUSES(GetVariableDependencies, "dependencies are not told by element", mechc_fmu *fmu,
                  uint32_t reference, size_t *elements, uint32_t *of, size_t *of_elements,
                  int *kinds, size_t count)
MECHC_FMI_REFUSES(EnterConfigurationMode, "there are no structural parameters", mechc_fmu *fmu)
MECHC_FMI_REFUSES(ExitConfigurationMode, "there are no structural parameters", mechc_fmu *fmu)

MECHC_FMI(EvaluateDiscreteStates)(mechc_fmu *fmu) { return MECHC_FMU_OK; }

MECHC_FMI(GetAdjointDerivative)(mechc_fmu *fmu, const uint32_t *unknowns, size_t unknown_count,
                                const uint32_t *knowns, size_t known_count, const double *seed,
                                size_t seed_count, double *gradient, size_t gradient_count)
{
    if (seed_count != unknown_count || gradient_count != known_count)
        return MECHC_FMI_MISCOUNTED(fmu);
    return (int)mechc_fmu_adjoint(fmu, unknowns, unknown_count, knowns, known_count, seed,
                                  gradient);
}

/* Model exchange. */

MECHC_FMI(UpdateDiscreteStates)(mechc_fmu *fmu, bool *again, bool *terminate,
                                bool *nominals_changed, bool *states_changed, bool *event_defined,
                                double *event)
{
    int changed, ends;
    const mechc_fmu_status status = mechc_fmu_update(fmu, &changed, &ends);
    *again = *nominals_changed = *event_defined = false;
    *event = 0.0;
    *states_changed = changed;
    *terminate = ends;
    return (int)status;
}

#define MECHC_FMI_COUNTS(name, number)                                                            \
    MECHC_FMI(name)(mechc_fmu *fmu, size_t *count)                                                \
    {                                                                                             \
        *count = number;                                                                          \
        return MECHC_FMU_OK;                                                                      \
    }
MECHC_FMI_COUNTS(GetNumberOfEventIndicators, MECHC_FMU_EVENTS)
MECHC_FMI_COUNTS(GetNumberOfContinuousStates, MECHC_NX)

/* Co-simulation. */

MECHC_FMI_ENTERS(EnterStepMode)

MECHC_FMI(DoStep)(mechc_fmu *fmu, double t, double h, bool no_way_back, bool *event,
                  bool *terminate, bool *early, double *last)
{
    const mechc_fmu_status status = mechc_fmu_step(fmu, t, h);
    *event = *terminate = *early = false;
    *last = fmu->now.t;
    return (int)status;
}
