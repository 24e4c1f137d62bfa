/* The functions that FMI 2.0 and 3.0 share, over the names and types in which they differ: those of FMI 3.0
 * unless a header has given others.
 *
 * No header declares the functions of FMI: importers find them by name. */
#pragma once

#include "fmu/advance.h"
#include "fmu/derivatives.h"
#include "fmu/exchange.h"

/* Unused parameters are allowed, since FMI prescribes arguments that this unit does not need. */
#pragma GCC diagnostic ignored "-Wunused-parameter"

#ifdef _WIN32
#define MECHC_EXPORTED __declspec(dllexport)
#else
#define MECHC_EXPORTED __attribute__((visibility("default")))
#endif

#ifndef MECHC_FMI_NAME
#include "fmu/names3.h"
#endif
#define MECHC_FMI(name) MECHC_EXPORTED int MECHC_FMI_NAME(name)

MECHC_STATIC void mechc_fmi_say_to(mechc_fmi_log *log, void *environment, const char *name,
                                   const char *message)
{
    if (log) MECHC_FMI_SAY(log, environment, name, message);
}

MECHC_STATIC void mechc_fmi_say(const mechc_fmu *fmu, mechc_fmu_status status, const char *message)
{
    mechc_fmi_say_to((mechc_fmi_log *)fmu->logger, fmu->environment, fmu->name, message);
}

MECHC_STATIC mechc_fmu *mechc_fmi_make(const char *name, const char *token, void *environment,
                                       mechc_fmi_log *log)
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
    return fmu;
}

MECHC_FMI(SetDebugLogging)(mechc_fmu *fmu, mechc_fmi_bool on, size_t count, const char *const *names)
{
    return MECHC_FMU_OK; /* there are no debug messages */
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
    MECHC_FMI(name)(__VA_ARGS__) { return (int)mechc_fmu_fails(fmu, why); }


/* Variables: all are real numbers. */

#define MECHC_FMI_REFERENCES const uint32_t *references, size_t count
#define MECHC_FMI_MISCOUNTED(fmu) (int)mechc_fmu_fails(fmu, "as many values as references")

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
        return count ? (int)mechc_fmu_fails(fmu, "there is no variable of this type") : 0;        \
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

/* States of the unit.
 *
 * In the instance that saved it a run continues to the last bit.  As bytes a state is a moment
 * alone: a run begins anew there. */

typedef struct {
    mechc_moment moment;
    int moved, driven;
    const mechc_fmu *of; /* whose run it is; NULL: bytes */
    double run[];
} mechc_fmu_saved;

MECHC_STATIC mechc_fmu_saved *mechc_fmu_new_saved(size_t size)
{
    return calloc(1, sizeof(mechc_fmu_saved) + size);
}

#define MECHC_FMU_BYTES sizeof(mechc_moment)

/* Save the state, replacing `state`, which may be NULL. */
MECHC_FMI(GetFMUState)(mechc_fmu *fmu, mechc_fmu_saved **state)
{
    mechc_fmu_saved *saved = mechc_fmu_new_saved(mechc_reach_saved_size(&fmu->reacher, 1));
    if (!saved) return (int)mechc_fmu_fails(fmu, "no memory");
    mechc_fmu_current(fmu);
    saved->moment = fmu->now;
    saved->moved = fmu->moved;
    saved->driven = fmu->driven;
    saved->of = fmu;
    mechc_reach_save(&fmu->reacher, saved->run, 1);
    free(*state);
    *state = saved;
    return MECHC_FMU_OK;
}

MECHC_FMI(SetFMUState)(mechc_fmu *fmu, const mechc_fmu_saved *saved)
{
    const int goes_on = saved->of == fmu;
    fmu->now = saved->moment;
    fmu->given_parameters = 1;
    fmu->moved = saved->moved;
    fmu->driven = saved->driven;
    fmu->evaluated = 0;
    mechc_fmu_set_options(fmu);
    return mechc_reach_restore(&fmu->reacher, fmu->now.t, fmu->now.y, goes_on ? saved->run : 0)
        ? MECHC_FMU_OK : (int)mechc_fmu_fails(fmu, "no memory");
}

MECHC_FMI(FreeFMUState)(mechc_fmu *fmu, mechc_fmu_saved **state)
{
    if (!state) return MECHC_FMU_OK;
    free(*state);
    *state = 0;
    return MECHC_FMU_OK;
}

MECHC_FMI(SerializedFMUStateSize)(mechc_fmu *fmu, const mechc_fmu_saved *state, size_t *size)
{
    *size = MECHC_FMU_BYTES;
    return MECHC_FMU_OK;
}

MECHC_FMI(SerializeFMUState)(mechc_fmu *fmu, const mechc_fmu_saved *saved, void *bytes, size_t size)
{
    if (size < MECHC_FMU_BYTES) return (int)mechc_fmu_fails(fmu, "a state needs more bytes");
    memcpy(bytes, &saved->moment, MECHC_FMU_BYTES);
    return MECHC_FMU_OK;
}

/* Restore a state from bytes, replacing `state`, which may be NULL. */
MECHC_FMI(DeserializeFMUState)(mechc_fmu *fmu, const void *bytes, size_t size,
                               mechc_fmu_saved **state)
{
    if (size < MECHC_FMU_BYTES) return (int)mechc_fmu_fails(fmu, "a state needs more bytes");
    mechc_fmu_saved *saved = mechc_fmu_new_saved(0);
    if (!saved) return (int)mechc_fmu_fails(fmu, "no memory");
    memcpy(&saved->moment, bytes, MECHC_FMU_BYTES);
    free(*state);
    *state = saved;
    return MECHC_FMU_OK;
}

/* Model exchange. */

/* Event mode is needed where loops drifted open or an event was crossed. */
MECHC_FMI(CompletedIntegratorStep)(mechc_fmu *fmu, mechc_fmi_bool no_way_back,
                                   mechc_fmi_bool *event, mechc_fmi_bool *terminate)
{
    *event = mechc_fmu_has_drifted(fmu) || mechc_fmu_missed(fmu);
    *terminate = 0;
    return MECHC_FMU_OK;
}

MECHC_FMI(SetTime)(mechc_fmu *fmu, double t)
{
    if (fmu->now.t != t) fmu->evaluated = 0;
    fmu->now.t = t;
    return MECHC_FMU_OK;
}

#define MECHC_FMI_STATES_MISCOUNTED(fmu) (int)mechc_fmu_fails(fmu, "this is not the number of states")

MECHC_FMI(SetContinuousStates)(mechc_fmu *fmu, const double *y, size_t count)
{
    if (count != MECHC_NX) return MECHC_FMI_STATES_MISCOUNTED(fmu);
    memcpy(fmu->now.y, y, MECHC_NX * sizeof *y);
    fmu->evaluated = 0;
    return MECHC_FMU_OK;
}

MECHC_FMI(GetContinuousStates)(mechc_fmu *fmu, double *y, size_t count)
{
    if (count != MECHC_NX) return MECHC_FMI_STATES_MISCOUNTED(fmu);
    memcpy(y, fmu->now.y, MECHC_NX * sizeof *y);
    return MECHC_FMU_OK;
}

/* The rates of the state.  If no motion exists at a trial step of the importer, it has to try a
 * shorter one. */
MECHC_FMI(GetContinuousStateDerivatives)(mechc_fmu *fmu, double *rates, size_t count)
{
    if (count != MECHC_NX) return MECHC_FMI_STATES_MISCOUNTED(fmu);
    mechc_fmu_evaluate(fmu);
    memcpy(rates, fmu->rates, MECHC_NX * sizeof *rates);
    return mechc_all_finite(rates, MECHC_NX) ? MECHC_FMU_OK : MECHC_FMU_DISCARD;
}

MECHC_FMI(GetNominalsOfContinuousStates)(mechc_fmu *fmu, double *nominals, size_t count)
{
    if (count != MECHC_NX) return MECHC_FMI_STATES_MISCOUNTED(fmu);
    memcpy(nominals, mechc_fmu_motion(fmu)->scale, count * sizeof *nominals);
    return MECHC_FMU_OK;
}

MECHC_FMI(GetEventIndicators)(mechc_fmu *fmu, double *values, size_t count)
{
    if (count != MECHC_FMU_EVENTS)
        return (int)mechc_fmu_fails(fmu, "this is not the number of event indicators");
    mechc_fmu_evaluate(fmu);
    if (MECHC_FMU_EVENTS > 0) memcpy(values, fmu->indicators, count * sizeof *values);
    return MECHC_FMU_OK;
}
