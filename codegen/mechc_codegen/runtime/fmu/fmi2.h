/* The functions of FMI 2.0 that importers call, over what the other headers do.
 *
 * Source of the interface: Functional Mock-up Interface for Model Exchange and Co-Simulation,
 * version 2.0.4, sections 2 to 4. */
#pragma once

#include "fmu/derivatives.h"
#include "fmu/public.h"

typedef void mechc_fmi2_log(void *environment, const char *name, int status, const char *category,
                            const char *message, ...);
typedef struct {
    mechc_fmi2_log *log;
    void *(*allocate)(size_t count, size_t size);
    void (*release)(void *memory);
    void (*finished)(void *environment, int status);
    void *environment;
} mechc_fmi2_callbacks;

typedef struct {
    int again, terminate, nominals_changed, states_changed, event_defined;
    double event;
} mechc_fmi2_event;

MECHC_STATIC void mechc_fmi2_say(const mechc_fmu *fmu, mechc_fmu_status status, const char *message)
{
    mechc_fmi2_log *log = (mechc_fmi2_log *)fmu->logger;
    if (log)
        log(fmu->environment, fmu->name, (int)status, "logStatusError", "%s", message);
}

MECHC_FMI const char *fmi2GetTypesPlatform(void) { return "default"; }
MECHC_FMI const char *fmi2GetVersion(void) { return "2.0"; }

MECHC_FMI int fmi2SetDebugLogging(mechc_fmu *fmu, int on, size_t count, const char *const *names)
{
    (void)count, (void)names;
    fmu->logging = on;
    return MECHC_FMU_OK;
}

MECHC_FMI void *fmi2Instantiate(const char *name, int type, const char *token,
                                const char *resources, const mechc_fmi2_callbacks *callbacks,
                                int visible, int logging)
{
    (void)type, (void)resources, (void)visible;
    mechc_fmu *fmu = mechc_fmu_make(name, token);
    if (!fmu) {
        if (callbacks && callbacks->log)
            callbacks->log(callbacks->environment, name, MECHC_FMU_ERROR, "logStatusError",
                           "no memory, or the guid is that of another description");
        return 0;
    }
    fmu->environment = callbacks ? callbacks->environment : 0;
    fmu->logger = callbacks ? (mechc_fmu_logger *)callbacks->log : 0;
    fmu->say = mechc_fmi2_say;
    fmu->logging = logging;
    return fmu;
}

MECHC_FMI void fmi2FreeInstance(mechc_fmu *fmu) { mechc_fmu_free(fmu); }

MECHC_FMI int fmi2SetupExperiment(mechc_fmu *fmu, int tolerance_defined, double tolerance,
                                  double t0, int end_defined, double end)
{
    (void)end_defined, (void)end;
    mechc_fmu_initialise(fmu, t0, tolerance_defined ? tolerance : 0.0);
    return MECHC_FMU_OK;
}

MECHC_FMI int fmi2EnterInitializationMode(mechc_fmu *fmu)
{
    return fmu ? MECHC_FMU_OK : MECHC_FMU_ERROR;
}

MECHC_FMI int fmi2ExitInitializationMode(mechc_fmu *fmu) { return (int)mechc_fmu_begin(fmu); }
MECHC_FMI int fmi2Terminate(mechc_fmu *fmu) { return fmu ? MECHC_FMU_OK : MECHC_FMU_ERROR; }

MECHC_FMI int fmi2Reset(mechc_fmu *fmu)
{
    mechc_fmu_reset(fmu);
    return MECHC_FMU_OK;
}

/* Variables: all are of the type Real. */

MECHC_FMI int fmi2GetReal(mechc_fmu *fmu, const uint32_t *references, size_t count, double *values)
{
    return (int)mechc_fmu_get(fmu, references, count, values);
}

MECHC_FMI int fmi2SetReal(mechc_fmu *fmu, const uint32_t *references, size_t count,
                          const double *values)
{
    return (int)mechc_fmu_set(fmu, references, count, values);
}

#define MECHC_FMI2_NONE(Type, type)                                                               \
    MECHC_FMI int fmi2Get##Type(mechc_fmu *fmu, const uint32_t *references, size_t count,         \
                                type *values)                                                     \
    {                                                                                             \
        (void)references, (void)values;                                                           \
        return (int)mechc_fmu_has_none(fmu, count);                                               \
    }                                                                                             \
    MECHC_FMI int fmi2Set##Type(mechc_fmu *fmu, const uint32_t *references, size_t count,         \
                                const type *values)                                               \
    {                                                                                             \
        (void)references, (void)values;                                                           \
        return (int)mechc_fmu_has_none(fmu, count);                                               \
    }
MECHC_FMI2_NONE(Integer, int)
MECHC_FMI2_NONE(Boolean, int)
MECHC_FMI2_NONE(String, char *)

/* States of the unit. */

MECHC_FMI int fmi2GetFMUstate(mechc_fmu *fmu, mechc_fmu_saved **state)
{
    return (int)mechc_fmu_save(fmu, state);
}

MECHC_FMI int fmi2SetFMUstate(mechc_fmu *fmu, const mechc_fmu_saved *state)
{
    return (int)mechc_fmu_restore(fmu, state);
}

MECHC_FMI int fmi2FreeFMUstate(mechc_fmu *fmu, mechc_fmu_saved **state)
{
    (void)fmu;
    return (int)mechc_fmu_forget_state(state);
}

MECHC_FMI int fmi2SerializedFMUstateSize(mechc_fmu *fmu, const mechc_fmu_saved *state, size_t *size)
{
    (void)fmu, (void)state;
    *size = MECHC_FMU_BYTES;
    return MECHC_FMU_OK;
}

MECHC_FMI int fmi2SerializeFMUstate(mechc_fmu *fmu, const mechc_fmu_saved *state, char *bytes,
                                    size_t size)
{
    return (int)mechc_fmu_to_bytes(fmu, state, bytes, size);
}

MECHC_FMI int fmi2DeSerializeFMUstate(mechc_fmu *fmu, const char *bytes, size_t size,
                                      mechc_fmu_saved **state)
{
    return (int)mechc_fmu_from_bytes(fmu, bytes, size, state);
}

MECHC_FMI int fmi2GetDirectionalDerivative(mechc_fmu *fmu, const uint32_t *unknowns,
                                           size_t unknown_count, const uint32_t *knowns,
                                           size_t known_count, const double *seed, double *changes)
{
    return (int)mechc_fmu_directional(fmu, unknowns, unknown_count, knowns, known_count, seed,
                                      changes);
}

/* Model exchange. */

MECHC_FMI int fmi2EnterEventMode(mechc_fmu *fmu) { return fmu ? MECHC_FMU_OK : MECHC_FMU_ERROR; }

MECHC_FMI int fmi2NewDiscreteStates(mechc_fmu *fmu, mechc_fmi2_event *event)
{
    memset(event, 0, sizeof *event);
    return (int)mechc_fmu_update(fmu, &event->states_changed, &event->terminate);
}

MECHC_FMI int fmi2EnterContinuousTimeMode(mechc_fmu *fmu)
{
    return fmu ? MECHC_FMU_OK : MECHC_FMU_ERROR;
}

MECHC_FMI int fmi2CompletedIntegratorStep(mechc_fmu *fmu, int no_way_back, int *event,
                                          int *terminate)
{
    (void)no_way_back;
    *event = mechc_fmu_asks_for_event(fmu);
    *terminate = 0;
    return MECHC_FMU_OK;
}

MECHC_FMI int fmi2SetTime(mechc_fmu *fmu, double t)
{
    mechc_fmu_set_time(fmu, t);
    return MECHC_FMU_OK;
}

MECHC_FMI int fmi2SetContinuousStates(mechc_fmu *fmu, const double *y, size_t count)
{
    return (int)mechc_fmu_set_states(fmu, y, count);
}

MECHC_FMI int fmi2GetContinuousStates(mechc_fmu *fmu, double *y, size_t count)
{
    return (int)mechc_fmu_states(fmu, y, count);
}

MECHC_FMI int fmi2GetDerivatives(mechc_fmu *fmu, double *rates, size_t count)
{
    return (int)mechc_fmu_rates(fmu, rates, count);
}

MECHC_FMI int fmi2GetNominalsOfContinuousStates(mechc_fmu *fmu, double *nominals, size_t count)
{
    return (int)mechc_fmu_nominals(fmu, nominals, count);
}

MECHC_FMI int fmi2GetEventIndicators(mechc_fmu *fmu, double *values, size_t count)
{
    return (int)mechc_fmu_indicators(fmu, values, count);
}

/* Co-simulation. */

MECHC_FMI int fmi2DoStep(mechc_fmu *fmu, double t, double h, int no_way_back)
{
    (void)no_way_back;
    return (int)mechc_fmu_step(fmu, t, h);
}

MECHC_FMI int fmi2CancelStep(mechc_fmu *fmu)
{
    return (int)mechc_fmu_fails(fmu, "steps are not taken in the background");
}

#define MECHC_FMI2_NO_RATES(name, constant)                                                       \
    MECHC_FMI int name(mechc_fmu *fmu, const uint32_t *references, size_t count,                  \
                       const int *orders, constant double *values)                                \
    {                                                                                             \
        (void)references, (void)orders, (void)values;                                             \
        return (int)mechc_fmu_has_none(fmu, count);                                               \
    }
MECHC_FMI2_NO_RATES(fmi2SetRealInputDerivatives, const)
MECHC_FMI2_NO_RATES(fmi2GetRealOutputDerivatives, )

MECHC_FMI int fmi2GetRealStatus(mechc_fmu *fmu, int kind, double *value)
{
    enum { LAST_SUCCESSFUL_TIME = 2 };
    if (kind != LAST_SUCCESSFUL_TIME) return MECHC_FMU_DISCARD;
    *value = fmu->now.t;
    return MECHC_FMU_OK;
}

#define MECHC_FMI2_NO_STATUS(Type, type)                                                          \
    MECHC_FMI int fmi2Get##Type##Status(mechc_fmu *fmu, int kind, type *value)                    \
    {                                                                                             \
        (void)fmu, (void)kind, (void)value;                                                       \
        return MECHC_FMU_DISCARD;                                                                 \
    }
MECHC_FMI2_NO_STATUS(, int)
MECHC_FMI2_NO_STATUS(Integer, int)
MECHC_FMI2_NO_STATUS(Boolean, int)
MECHC_FMI2_NO_STATUS(String, const char *)
