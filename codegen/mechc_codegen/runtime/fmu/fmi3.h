/* The functions of FMI 3.0 that importers call, over what the other headers do.
 *
 * Source of the interface: Functional Mock-up Interface Specification, version 3.0.2, sections 2 to
 * 4. */
#pragma once

#include <stdbool.h>
#include "fmu/advance.h"
#include "fmu/derivatives.h"
#include "fmu/exchange.h"
#include "fmu/public.h"
#include "fmu/saved_state.h"

typedef void mechc_fmi3_log(void *environment, int status, const char *category,
                            const char *message);

MECHC_STATIC void mechc_fmi3_say(const mechc_fmu *fmu, mechc_fmu_status status, const char *message)
{
    mechc_fmi3_log *log = (mechc_fmi3_log *)fmu->logger;
    if (log) log(fmu->environment, (int)status, "logStatusError", message);
}

MECHC_STATIC void *mechc_fmi3_make(const char *name, const char *token, bool logging,
                                   void *environment, mechc_fmi3_log *log)
{
    mechc_fmu *fmu = mechc_fmu_make(name, token);
    if (!fmu) {
        if (log) log(environment, MECHC_FMU_ERROR, "logStatusError",
                     "no memory, or the instantiation token is that of another description");
        return 0;
    }
    fmu->environment = environment;
    fmu->logger = (mechc_fmu_logger *)log;
    fmu->say = mechc_fmi3_say;
    fmu->logging = logging;
    return fmu;
}

MECHC_FMI const char *fmi3GetVersion(void) { return "3.0"; }

MECHC_FMI int fmi3SetDebugLogging(mechc_fmu *fmu, bool on, size_t count, const char *const *names)
{
    (void)count, (void)names;
    fmu->logging = on;
    return MECHC_FMU_OK;
}

MECHC_FMI void *fmi3InstantiateModelExchange(const char *name, const char *token,
                                             const char *resources, bool visible, bool logging,
                                             void *environment, mechc_fmi3_log *log)
{
    (void)resources, (void)visible;
    return mechc_fmi3_make(name, token, logging, environment, log);
}

MECHC_FMI void *fmi3InstantiateCoSimulation(const char *name, const char *token,
                                            const char *resources, bool visible, bool logging,
                                            bool events, bool early, const uint32_t *required,
                                            size_t required_count, void *environment,
                                            mechc_fmi3_log *log, void (*intermediate)(void))
{
    (void)resources, (void)visible, (void)early, (void)required, (void)required_count;
    (void)intermediate;
    if (events) return 0; /* the description says that there are none */
    return mechc_fmi3_make(name, token, logging, environment, log);
}

MECHC_FMI void *fmi3InstantiateScheduledExecution(const char *name, const char *token,
                                                  const char *resources, bool visible,
                                                  bool logging, void *environment,
                                                  mechc_fmi3_log *log, void (*clock)(void),
                                                  void (*lock)(void), void (*unlock)(void))
{
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)environment;
    (void)log, (void)clock, (void)lock, (void)unlock;
    return 0;
}

MECHC_FMI void fmi3FreeInstance(mechc_fmu *fmu) { mechc_fmu_free(fmu); }

MECHC_FMI int fmi3EnterInitializationMode(mechc_fmu *fmu, bool tolerance_defined, double tolerance,
                                          double t0, bool end_defined, double end)
{
    (void)end_defined, (void)end;
    mechc_fmu_initialise(fmu, t0, tolerance_defined ? tolerance : 0.0);
    return MECHC_FMU_OK;
}

MECHC_FMI int fmi3ExitInitializationMode(mechc_fmu *fmu) { return (int)mechc_fmu_begin(fmu); }
MECHC_FMI int fmi3Terminate(mechc_fmu *fmu) { return fmu ? MECHC_FMU_OK : MECHC_FMU_ERROR; }

MECHC_FMI int fmi3Reset(mechc_fmu *fmu)
{
    mechc_fmu_reset(fmu);
    return MECHC_FMU_OK;
}

/* Variables: all are of the type Float64. */

MECHC_FMI int fmi3GetFloat64(mechc_fmu *fmu, const uint32_t *references, size_t count,
                             double *values, size_t value_count)
{
    if (value_count != count) return (int)mechc_fmu_fails(fmu, "as many values as references");
    return (int)mechc_fmu_get(fmu, references, count, values);
}

MECHC_FMI int fmi3SetFloat64(mechc_fmu *fmu, const uint32_t *references, size_t count,
                             const double *values, size_t value_count)
{
    if (value_count != count) return (int)mechc_fmu_fails(fmu, "as many values as references");
    return (int)mechc_fmu_set(fmu, references, count, values);
}

#define MECHC_FMI3_NONE(Type, type)                                                               \
    MECHC_FMI int fmi3Get##Type(mechc_fmu *fmu, const uint32_t *references, size_t count,         \
                                type *values, size_t value_count)                                 \
    {                                                                                             \
        (void)references, (void)values, (void)value_count;                                        \
        return (int)mechc_fmu_has_none(fmu, count);                                               \
    }                                                                                             \
    MECHC_FMI int fmi3Set##Type(mechc_fmu *fmu, const uint32_t *references, size_t count,         \
                                const type *values, size_t value_count)                           \
    {                                                                                             \
        (void)references, (void)values, (void)value_count;                                        \
        return (int)mechc_fmu_has_none(fmu, count);                                               \
    }
MECHC_FMI3_NONE(Float32, float)
MECHC_FMI3_NONE(Int8, int8_t)
MECHC_FMI3_NONE(UInt8, uint8_t)
MECHC_FMI3_NONE(Int16, int16_t)
MECHC_FMI3_NONE(UInt16, uint16_t)
MECHC_FMI3_NONE(Int32, int32_t)
MECHC_FMI3_NONE(UInt32, uint32_t)
MECHC_FMI3_NONE(Int64, int64_t)
MECHC_FMI3_NONE(UInt64, uint64_t)
MECHC_FMI3_NONE(Boolean, bool)
MECHC_FMI3_NONE(String, char *)

MECHC_FMI int fmi3GetBinary(mechc_fmu *fmu, const uint32_t *references, size_t count,
                            size_t *sizes, const uint8_t **values, size_t value_count)
{
    (void)references, (void)sizes, (void)values, (void)value_count;
    return (int)mechc_fmu_has_none(fmu, count);
}

MECHC_FMI int fmi3SetBinary(mechc_fmu *fmu, const uint32_t *references, size_t count,
                            const size_t *sizes, const uint8_t *const *values, size_t value_count)
{
    (void)references, (void)sizes, (void)values, (void)value_count;
    return (int)mechc_fmu_has_none(fmu, count);
}

/* Clocks, and what only a unit with clocks or arrays of variable size has. */
#define MECHC_UNUSED __attribute__((unused))
#define MECHC_FMI3_NO_CLOCK(name, ...)                                                            \
    MECHC_FMI int fmi3##name(mechc_fmu *fmu, MECHC_UNUSED const uint32_t *references,             \
                             size_t count, __VA_ARGS__)                                           \
    {                                                                                             \
        return (int)mechc_fmu_has_none(fmu, count);                                               \
    }
MECHC_FMI3_NO_CLOCK(GetClock, MECHC_UNUSED bool *ticks)
MECHC_FMI3_NO_CLOCK(SetClock, MECHC_UNUSED const bool *ticks)
MECHC_FMI3_NO_CLOCK(GetIntervalDecimal, MECHC_UNUSED double *intervals, MECHC_UNUSED int *kinds)
MECHC_FMI3_NO_CLOCK(GetIntervalFraction, MECHC_UNUSED uint64_t *counters,
                    MECHC_UNUSED uint64_t *resolutions, MECHC_UNUSED int *kinds)
MECHC_FMI3_NO_CLOCK(GetShiftDecimal, MECHC_UNUSED double *shifts)
MECHC_FMI3_NO_CLOCK(GetShiftFraction, MECHC_UNUSED uint64_t *counters,
                    MECHC_UNUSED uint64_t *resolutions)
MECHC_FMI3_NO_CLOCK(SetIntervalDecimal, MECHC_UNUSED const double *intervals)
MECHC_FMI3_NO_CLOCK(SetIntervalFraction, MECHC_UNUSED const uint64_t *counters,
                    MECHC_UNUSED const uint64_t *resolutions)
MECHC_FMI3_NO_CLOCK(SetShiftDecimal, MECHC_UNUSED const double *shifts)
MECHC_FMI3_NO_CLOCK(SetShiftFraction, MECHC_UNUSED const uint64_t *counters,
                    MECHC_UNUSED const uint64_t *resolutions)
MECHC_FMI3_NO_CLOCK(GetOutputDerivatives, MECHC_UNUSED const int32_t *orders,
                    MECHC_UNUSED double *values, MECHC_UNUSED size_t value_count)

MECHC_FMI int fmi3GetNumberOfVariableDependencies(mechc_fmu *fmu, uint32_t reference, size_t *n)
{
    (void)reference, (void)n;
    return (int)mechc_fmu_fails(fmu, "dependencies are not told by element");
}

MECHC_FMI int fmi3GetVariableDependencies(mechc_fmu *fmu, uint32_t reference, size_t *elements,
                                          uint32_t *of, size_t *of_elements, int *kinds, size_t n)
{
    (void)reference, (void)elements, (void)of, (void)of_elements, (void)kinds, (void)n;
    return (int)mechc_fmu_fails(fmu, "dependencies are not told by element");
}

MECHC_FMI int fmi3EnterConfigurationMode(mechc_fmu *fmu)
{
    return (int)mechc_fmu_fails(fmu, "there are no structural parameters");
}

MECHC_FMI int fmi3ExitConfigurationMode(mechc_fmu *fmu)
{
    return (int)mechc_fmu_fails(fmu, "there are no structural parameters");
}

MECHC_FMI int fmi3EvaluateDiscreteStates(mechc_fmu *fmu)
{
    (void)fmu;
    return MECHC_FMU_OK;
}

MECHC_FMI int fmi3ActivateModelPartition(mechc_fmu *fmu, uint32_t clock, double t)
{
    (void)clock, (void)t;
    return (int)mechc_fmu_fails(fmu, "there are no clocks");
}

/* States of the unit. */

MECHC_FMI int fmi3GetFMUState(mechc_fmu *fmu, mechc_fmu_saved **state)
{
    return (int)mechc_fmu_save(fmu, state);
}

MECHC_FMI int fmi3SetFMUState(mechc_fmu *fmu, const mechc_fmu_saved *state)
{
    return (int)mechc_fmu_restore(fmu, state);
}

MECHC_FMI int fmi3FreeFMUState(mechc_fmu *fmu, mechc_fmu_saved **state)
{
    (void)fmu;
    return (int)mechc_fmu_forget_state(state);
}

MECHC_FMI int fmi3SerializedFMUStateSize(mechc_fmu *fmu, const mechc_fmu_saved *state, size_t *size)
{
    (void)fmu, (void)state;
    *size = MECHC_FMU_BYTES;
    return MECHC_FMU_OK;
}

MECHC_FMI int fmi3SerializeFMUState(mechc_fmu *fmu, const mechc_fmu_saved *state, uint8_t *bytes,
                                    size_t size)
{
    return (int)mechc_fmu_to_bytes(fmu, state, bytes, size);
}

MECHC_FMI int fmi3DeserializeFMUState(mechc_fmu *fmu, const uint8_t *bytes, size_t size,
                                      mechc_fmu_saved **state)
{
    return (int)mechc_fmu_from_bytes(fmu, bytes, size, state);
}

/* Derivatives. */

MECHC_FMI int fmi3GetDirectionalDerivative(mechc_fmu *fmu, const uint32_t *unknowns,
                                           size_t unknown_count, const uint32_t *knowns,
                                           size_t known_count, const double *seed,
                                           size_t seed_count, double *changes, size_t change_count)
{
    if (seed_count != known_count || change_count != unknown_count)
        return (int)mechc_fmu_fails(fmu, "as many values as references");
    return (int)mechc_fmu_directional(fmu, unknowns, unknown_count, knowns, known_count, seed,
                                      changes);
}

MECHC_FMI int fmi3GetAdjointDerivative(mechc_fmu *fmu, const uint32_t *unknowns,
                                       size_t unknown_count, const uint32_t *knowns,
                                       size_t known_count, const double *seed, size_t seed_count,
                                       double *gradient, size_t gradient_count)
{
    if (seed_count != unknown_count || gradient_count != known_count)
        return (int)mechc_fmu_fails(fmu, "as many values as references");
    return (int)mechc_fmu_adjoint(fmu, unknowns, unknown_count, knowns, known_count, seed,
                                  gradient);
}

/* Model exchange. */

MECHC_FMI int fmi3EnterEventMode(mechc_fmu *fmu) { return fmu ? MECHC_FMU_OK : MECHC_FMU_ERROR; }

MECHC_FMI int fmi3UpdateDiscreteStates(mechc_fmu *fmu, bool *again, bool *terminate,
                                       bool *nominals_changed, bool *states_changed,
                                       bool *event_defined, double *event)
{
    int changed, ends;
    const mechc_fmu_status status = mechc_fmu_update(fmu, &changed, &ends);
    *again = *nominals_changed = *event_defined = false;
    *event = 0.0;
    *states_changed = changed;
    *terminate = ends;
    return (int)status;
}

MECHC_FMI int fmi3EnterContinuousTimeMode(mechc_fmu *fmu)
{
    return fmu ? MECHC_FMU_OK : MECHC_FMU_ERROR;
}

MECHC_FMI int fmi3CompletedIntegratorStep(mechc_fmu *fmu, bool no_way_back, bool *event,
                                          bool *terminate)
{
    (void)no_way_back;
    *event = mechc_fmu_asks_for_event(fmu);
    *terminate = false;
    return MECHC_FMU_OK;
}

MECHC_FMI int fmi3SetTime(mechc_fmu *fmu, double t)
{
    mechc_fmu_set_time(fmu, t);
    return MECHC_FMU_OK;
}

MECHC_FMI int fmi3SetContinuousStates(mechc_fmu *fmu, const double *y, size_t count)
{
    return (int)mechc_fmu_set_states(fmu, y, count);
}

MECHC_FMI int fmi3GetContinuousStates(mechc_fmu *fmu, double *y, size_t count)
{
    return (int)mechc_fmu_states(fmu, y, count);
}

MECHC_FMI int fmi3GetContinuousStateDerivatives(mechc_fmu *fmu, double *rates, size_t count)
{
    return (int)mechc_fmu_rates(fmu, rates, count);
}

MECHC_FMI int fmi3GetNominalsOfContinuousStates(mechc_fmu *fmu, double *nominals, size_t count)
{
    return (int)mechc_fmu_nominals(fmu, nominals, count);
}

MECHC_FMI int fmi3GetEventIndicators(mechc_fmu *fmu, double *values, size_t count)
{
    return (int)mechc_fmu_indicators(fmu, values, count);
}

MECHC_FMI int fmi3GetNumberOfEventIndicators(mechc_fmu *fmu, size_t *count)
{
    (void)fmu;
    *count = MECHC_FMU_EVENTS;
    return MECHC_FMU_OK;
}

MECHC_FMI int fmi3GetNumberOfContinuousStates(mechc_fmu *fmu, size_t *count)
{
    (void)fmu;
    *count = MECHC_NX;
    return MECHC_FMU_OK;
}

/* Co-simulation. */

MECHC_FMI int fmi3EnterStepMode(mechc_fmu *fmu) { return fmu ? MECHC_FMU_OK : MECHC_FMU_ERROR; }

MECHC_FMI int fmi3DoStep(mechc_fmu *fmu, double t, double h, bool no_way_back, bool *event,
                         bool *terminate, bool *early, double *last)
{
    (void)no_way_back;
    const mechc_fmu_status status = mechc_fmu_step(fmu, t, h);
    *event = *terminate = *early = false;
    *last = fmu->now.t;
    return (int)status;
}
