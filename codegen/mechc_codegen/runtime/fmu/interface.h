/* The functions that FMI 2.0 and 3.0 share, and the names and types in which they differ.
 *
 * No header declares the functions of FMI: importers find them by name. */
#pragma once

#include "fmu/advance.h"
#include "fmu/derivatives.h"
#include "fmu/exchange.h"
#include "fmu/saved_state.h"

/* Unused parameters are allowed, since FMI prescribes arguments that this unit does not need. */
#pragma GCC diagnostic ignored "-Wunused-parameter"

#ifdef _WIN32
#define MECHC_EXPORTED __declspec(dllexport)
#else
#define MECHC_EXPORTED __attribute__((visibility("default")))
#endif

#ifndef MECHC_FMI_VERSION
#define MECHC_FMI_VERSION 3
#endif
#if MECHC_FMI_VERSION == 2
typedef int mechc_fmi_bool;
typedef void mechc_fmi_log(void *environment, const char *name, int status, const char *category,
                           const char *message, ...);
#define MECHC_FMI_NAME(name) fmi2##name
#define MECHC_FMI_COUNT(name) /* references alone are counted */
#define MECHC_FMI_AS_MANY(values, references) 1
#define fmi2GetFloat64 fmi2GetReal
#define fmi2SetFloat64 fmi2SetReal
#define fmi2GetFMUState fmi2GetFMUstate
#define fmi2SetFMUState fmi2SetFMUstate
#define fmi2FreeFMUState fmi2FreeFMUstate
#define fmi2SerializedFMUStateSize fmi2SerializedFMUstateSize
#define fmi2SerializeFMUState fmi2SerializeFMUstate
#define fmi2DeserializeFMUState fmi2DeSerializeFMUstate
#define fmi2GetContinuousStateDerivatives fmi2GetDerivatives
#else
#include <stdbool.h>
typedef bool mechc_fmi_bool;
typedef void mechc_fmi_log(void *environment, int status, const char *category,
                           const char *message);
#define MECHC_FMI_NAME(name) fmi3##name
#define MECHC_FMI_COUNT(name) , size_t name
#define MECHC_FMI_AS_MANY(values, references) ((values) == (references))
#endif
#define MECHC_FMI(name) MECHC_EXPORTED int MECHC_FMI_NAME(name)

MECHC_STATIC void mechc_fmi_say_to(mechc_fmi_log *log, void *environment, const char *name,
                                   const char *message)
{
#if MECHC_FMI_VERSION == 2
    if (log) log(environment, name, MECHC_FMU_ERROR, "logStatusError", "%s", message);
#else
    if (log) log(environment, MECHC_FMU_ERROR, "logStatusError", message);
#endif
}

MECHC_STATIC void mechc_fmi_say(const mechc_fmu *fmu, mechc_fmu_status status, const char *message)
{
    mechc_fmi_say_to((mechc_fmi_log *)fmu->logger, fmu->environment, fmu->name, message);
}

MECHC_STATIC mechc_fmu *mechc_fmi_make(const char *name, const char *token, int logging,
                                       void *environment, mechc_fmi_log *log)
{
    mechc_fmu *fmu = mechc_fmu_make(name, token);
    if (!fmu) {
        mechc_fmi_say_to(log, environment, name,
                         "no memory, or the instantiation token is that of another description");
        return 0;
    }
    fmu->environment = environment;
    fmu->logger = (mechc_fmu_logger *)log;
    fmu->say = mechc_fmi_say;
    fmu->logging = logging;
    return fmu;
}

MECHC_FMI(SetDebugLogging)(mechc_fmu *fmu, mechc_fmi_bool on, size_t count, const char *const *names)
{
    fmu->logging = on;
    return MECHC_FMU_OK;
}

MECHC_EXPORTED void MECHC_FMI_NAME(FreeInstance)(mechc_fmu *fmu) { mechc_fmu_free(fmu); }

MECHC_FMI(Reset)(mechc_fmu *fmu)
{
    mechc_fmu_reset(fmu);
    return MECHC_FMU_OK;
}

MECHC_FMI(ExitInitializationMode)(mechc_fmu *fmu) { return (int)mechc_fmu_begin(fmu); }

/* Functions that enter a mode and do nothing else. */
#define MECHC_FMI_ENTERS(name) \
    MECHC_FMI(name)(mechc_fmu *fmu) { return fmu ? MECHC_FMU_OK : MECHC_FMU_ERROR; }
MECHC_FMI_ENTERS(EnterEventMode)
MECHC_FMI_ENTERS(EnterContinuousTimeMode)
MECHC_FMI_ENTERS(Terminate)

/* Functions for features that the unit lacks. */
#define MECHC_FMI_REFUSES(name, why, ...) \
    MECHC_FMI(name)(mechc_fmu *fmu, __VA_ARGS__) { return (int)mechc_fmu_fails(fmu, why); }

/* Variables: all are real numbers. */

#define MECHC_FMI_REFERENCES const uint32_t *references, size_t count
#define MECHC_FMI_MISCOUNTED(fmu) (int)mechc_fmu_fails(fmu, "as many values as references")

MECHC_STATIC int mechc_fmi_has_none(const mechc_fmu *fmu, size_t count)
{
    return count == 0 ? MECHC_FMU_OK : mechc_fmu_fails(fmu, "there is no variable of this type");
}

MECHC_FMI(GetFloat64)(mechc_fmu *fmu, MECHC_FMI_REFERENCES, double *values MECHC_FMI_COUNT(size))
{
    if (!MECHC_FMI_AS_MANY(size, count)) return MECHC_FMI_MISCOUNTED(fmu);
    return (int)mechc_fmu_get(fmu, references, count, values);
}

MECHC_FMI(SetFloat64)(mechc_fmu *fmu, MECHC_FMI_REFERENCES,
                      const double *values MECHC_FMI_COUNT(size))
{
    if (!MECHC_FMI_AS_MANY(size, count)) return MECHC_FMI_MISCOUNTED(fmu);
    return (int)mechc_fmu_set(fmu, references, count, values);
}

#define MECHC_FMI_NONE(name, ...)                                                                 \
    MECHC_FMI(name)(mechc_fmu *fmu, MECHC_FMI_REFERENCES, __VA_ARGS__)                            \
    {                                                                                             \
        return mechc_fmi_has_none(fmu, count);                                                    \
    }
#define MECHC_FMI_NO_TYPE(Type, type)                                                             \
    MECHC_FMI_NONE(Get##Type, type *values MECHC_FMI_COUNT(size))                                 \
    MECHC_FMI_NONE(Set##Type, const type *values MECHC_FMI_COUNT(size))
MECHC_FMI_NO_TYPE(Boolean, mechc_fmi_bool)
MECHC_FMI_NO_TYPE(String, char *)

MECHC_FMI(GetDirectionalDerivative)(mechc_fmu *fmu, const uint32_t *unknowns, size_t unknown_count,
                                    const uint32_t *knowns, size_t known_count,
                                    const double *seed MECHC_FMI_COUNT(seed_count),
                                    double *changes MECHC_FMI_COUNT(change_count))
{
    if (!MECHC_FMI_AS_MANY(seed_count, known_count)
        || !MECHC_FMI_AS_MANY(change_count, unknown_count))
        return MECHC_FMI_MISCOUNTED(fmu);
    return (int)mechc_fmu_directional(fmu, unknowns, unknown_count, knowns, known_count, seed,
                                      changes);
}

/* States of the unit. */

MECHC_FMI(GetFMUState)(mechc_fmu *fmu, mechc_fmu_saved **state)
{
    return (int)mechc_fmu_save(fmu, state);
}

MECHC_FMI(SetFMUState)(mechc_fmu *fmu, const mechc_fmu_saved *state)
{
    return (int)mechc_fmu_restore(fmu, state);
}

MECHC_FMI(FreeFMUState)(mechc_fmu *fmu, mechc_fmu_saved **state)
{
    return (int)mechc_fmu_forget_state(state);
}

MECHC_FMI(SerializedFMUStateSize)(mechc_fmu *fmu, const mechc_fmu_saved *state, size_t *size)
{
    *size = MECHC_FMU_BYTES;
    return MECHC_FMU_OK;
}

MECHC_FMI(SerializeFMUState)(mechc_fmu *fmu, const mechc_fmu_saved *state, void *bytes, size_t size)
{
    return (int)mechc_fmu_to_bytes(fmu, state, bytes, size);
}

MECHC_FMI(DeserializeFMUState)(mechc_fmu *fmu, const void *bytes, size_t size,
                               mechc_fmu_saved **state)
{
    return (int)mechc_fmu_from_bytes(fmu, bytes, size, state);
}

/* Model exchange. */

MECHC_FMI(CompletedIntegratorStep)(mechc_fmu *fmu, mechc_fmi_bool no_way_back,
                                   mechc_fmi_bool *event, mechc_fmi_bool *terminate)
{
    *event = mechc_fmu_asks_for_event(fmu);
    *terminate = 0;
    return MECHC_FMU_OK;
}

MECHC_FMI(SetTime)(mechc_fmu *fmu, double t)
{
    mechc_fmu_set_time(fmu, t);
    return MECHC_FMU_OK;
}

#define MECHC_FMI_VECTOR(name, number, of)                                                        \
    MECHC_FMI(name)(mechc_fmu *fmu, number *values, size_t count)                                 \
    {                                                                                             \
        return (int)of(fmu, values, count);                                                       \
    }
MECHC_FMI_VECTOR(SetContinuousStates, const double, mechc_fmu_set_states)
MECHC_FMI_VECTOR(GetContinuousStates, double, mechc_fmu_states)
MECHC_FMI_VECTOR(GetContinuousStateDerivatives, double, mechc_fmu_rates)
MECHC_FMI_VECTOR(GetNominalsOfContinuousStates, double, mechc_fmu_nominals)
MECHC_FMI_VECTOR(GetEventIndicators, double, mechc_fmu_indicators)
