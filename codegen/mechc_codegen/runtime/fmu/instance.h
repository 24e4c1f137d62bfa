/* One instance of the unit: its values by their references, evaluated when they are asked for.
 *
 * References: time, states, their rates, parameters, the least drift, inputs, outputs, events. */
#pragma once

#include <stdint.h>
#include <stdlib.h>
#include "fmu/model.h"
#include "fmu/outputs.h"
#if MECHC_FMU_EVENTS > 0
#include "events/resets.h"
#endif
#include "unit/standalone.h"
#include "unit/unit.h"

enum {
    MECHC_OF_STATES = 1,
    MECHC_OF_RATES = MECHC_OF_STATES + MECHC_NX,
    MECHC_OF_PARAMETERS = MECHC_OF_RATES + MECHC_NX,
    MECHC_OF_DRIFT = MECHC_OF_PARAMETERS + MECHC_NP,
    MECHC_OF_INPUTS = MECHC_OF_DRIFT + 1,
    MECHC_OF_OUTPUTS = MECHC_OF_INPUTS + MECHC_FMU_INPUTS,
    MECHC_OF_EVENTS = MECHC_OF_OUTPUTS + MECHC_FMU_VALUES,
    MECHC_REFERENCES = MECHC_OF_EVENTS + MECHC_FMU_EVENTS
};

#define MECHC_UNIT_TABLE MECHC_JOIN(mechc_unit_, MECHC_UNIT)

/* How a call ended: the numbers of both versions of FMI. */
typedef enum { MECHC_FMU_OK = 0, MECHC_FMU_DISCARD = 2, MECHC_FMU_ERROR = 3 } mechc_fmu_status;

/* All that a motion goes on from. */
typedef struct {
    double t, rtol, drift;
    double y[MECHC_NX], p[MECHC_AT_LEAST_ONE(MECHC_NP)], inputs[MECHC_AT_LEAST_ONE(MECHC_NI)];
    double side[MECHC_AT_LEAST_ONE(MECHC_FMU_EVENTS)]; /* the sign that each event has after it */
    unsigned char away[MECHC_AT_LEAST_ONE(MECHC_FMU_EVENTS)]; /* not seen there since its reset */
} mechc_moment;

typedef void mechc_fmu_logger(void);
typedef struct mechc_fmu mechc_fmu;
struct mechc_fmu {
    mechc_moment now;
    int given_parameters; /* since `model` was made of them */
    int moved;            /* time, state or parameters were given: a run begins anew */
    int driven;           /* inputs were given: a run goes on with others */
    int evaluated;        /* rates and outputs are those of `now` */
    mechc_standalone model;
    double rates[MECHC_NX], outputs[MECHC_AT_LEAST_ONE(MECHC_FMU_VALUES)];
    double indicators[MECHC_AT_LEAST_ONE(MECHC_FMU_EVENTS)];
    mechc_held held; /* the inputs, as a run takes them */
    mechc_run *run;  /* of co-simulation; it may be ahead */
#if MECHC_FMU_EVENTS > 0
    mechc_watch watch;
    double scale[MECHC_NX]; /* of its states */
    ptrdiff_t looked;       /* steps of the run that were searched */
    double stop;            /* time of a reset that the run has come to, or HUGE_VAL */
#endif
    void *environment;
    void (*say)(const mechc_fmu *fmu, mechc_fmu_status status, const char *message);
    mechc_fmu_logger *logger; /* the importer's, of the version's type */
    int logging;
    char *name;
};

MECHC_STATIC mechc_fmu_status mechc_fmu_fails(const mechc_fmu *fmu, const char *message)
{
    if (fmu->logging && fmu->say) fmu->say(fmu, MECHC_FMU_ERROR, message);
    return MECHC_FMU_ERROR;
}

MECHC_STATIC void mechc_fmu_drop_run(mechc_fmu *fmu)
{
#if MECHC_FMU_EVENTS > 0
    fmu->stop = HUGE_VAL;
#endif
    if (!fmu->run) return;
    mechc_unit_release(fmu->run);
    free(fmu->run);
    fmu->run = 0;
}

/* To what an instance begins with. */
MECHC_STATIC void mechc_fmu_reset(mechc_fmu *fmu)
{
    const mechc_fmu_model *scene = &mechc_fmu_scene;
    mechc_fmu_drop_run(fmu);
    memset(&fmu->now, 0, sizeof fmu->now);
    memcpy(fmu->now.y, scene->y, sizeof fmu->now.y);
    if (MECHC_NP > 0) memcpy(fmu->now.p, scene->p, sizeof fmu->now.p);
    fmu->now.rtol = scene->rtol;
    fmu->now.drift = scene->drift;
    fmu->held.head.evaluate = mechc_held_values;
    fmu->held.head.needs_state = 0;
    fmu->held.values = fmu->now.inputs;
    fmu->given_parameters = fmu->moved = 1;
    fmu->driven = fmu->evaluated = 0;
}

/* Room for the events; 0 without memory. */
MECHC_STATIC int mechc_fmu_make_events(mechc_fmu *fmu)
{
#if MECHC_FMU_EVENTS > 0
    const mechc_fmu_model *scene = &mechc_fmu_scene;
    if (!mechc_watch_make(&fmu->watch, &MECHC_UNIT_TABLE, scene->events, MECHC_NQ, MECHC_NU,
                          MECHC_NC))
        return 0;
    for (int k = 0; k < MECHC_FMU_EVENTS; k++)
        fmu->watch.event[k].direction = scene->directions[k];
#else
    (void)fmu;
#endif
    return 1;
}

MECHC_STATIC void mechc_fmu_free(mechc_fmu *fmu)
{
    if (!fmu) return;
    mechc_fmu_drop_run(fmu);
#if MECHC_FMU_EVENTS > 0
    mechc_watch_free(&fmu->watch);
#endif
    free(fmu->name);
    free(fmu);
}

/* NULL where memory is out or the token is that of another description. */
MECHC_STATIC mechc_fmu *mechc_fmu_make(const char *name, const char *token)
{
    if (!token || strcmp(token, mechc_fmu_scene.token)) return 0;
    mechc_fmu *fmu = calloc(1, sizeof *fmu);
    if (!fmu) return 0;
    const size_t room = name ? strlen(name) + 1 : 1;
    fmu->name = calloc(1, room);
    if (!fmu->name || !mechc_fmu_make_events(fmu)) {
        mechc_fmu_free(fmu);
        return 0;
    }
    if (name) memcpy(fmu->name, name, room);
    mechc_fmu_reset(fmu);
    return fmu;
}

/* The model of the present parameters and inputs. */
MECHC_STATIC mechc_standalone *mechc_fmu_current(mechc_fmu *fmu)
{
    if (fmu->given_parameters) {
        mechc_fmu_scene.complete(fmu->now.p);
        mechc_standalone_set(&fmu->model, fmu->now.p, fmu->now.t, fmu->now.y);
        fmu->given_parameters = 0;
    }
    if (MECHC_NI > 0) memcpy(fmu->model.inputs, fmu->now.inputs, sizeof fmu->model.inputs);
    return &fmu->model;
}

/* Sizes of the components of a state: 1, or the largest length. */
MECHC_STATIC void mechc_fmu_scale(mechc_fmu *fmu, double *scale)
{
    const mechc_fmu_model *scene = &mechc_fmu_scene;
    double longest = 0.0;
    mechc_fmu_current(fmu);
    for (int i = 0; i < scene->length_count; i++)
        longest = mechc_max(longest, fabs(fmu->now.p[scene->lengths[i]]));
    for (int i = 0; i < MECHC_NX; i++)
        scale[i] = scene->dimensionless[i] || !(longest > 0.0) ? 1.0 : longest;
}

/* Close the loops at the nearest state.  The constraints that count are found on them. */
MECHC_STATIC int mechc_fmu_close(mechc_fmu *fmu)
{
    const int status = mechc_standalone_project(mechc_fmu_current(fmu), fmu->now.t, fmu->now.y);
    fmu->given_parameters = 1;
    fmu->evaluated = 0;
    mechc_fmu_current(fmu);
    return status;
}

MECHC_STATIC void mechc_fmu_evaluate(mechc_fmu *fmu)
{
    if (fmu->evaluated) return;
    const mechc_standalone *model = mechc_fmu_current(fmu);
    double *out = fmu->outputs;
    mechc_standalone_rates(model, fmu->now.t, fmu->now.y, fmu->rates);
#define MECHC_FMU_EVALUATE(label, width) \
    mechc_standalone_##label(model, fmu->now.t, fmu->now.y, out), out += width;
    MECHC_FMU_OUTPUTS(MECHC_FMU_EVALUATE)
    (void)out;
    for (int k = 0; k < MECHC_FMU_EVENTS; k++)
        fmu->indicators[k] = mechc_fmu_scene.events->functions[k].value(fmu->now.t, fmu->now.y,
                                                                        fmu->now.p);
    fmu->evaluated = 1;
}

/* In one range of references, which may be empty. */
MECHC_INLINE int mechc_fmu_within(int64_t reference, int first, int after)
{
    return reference >= first && reference < after;
}

/* Where the value is kept that a reference names; NULL for none. */
MECHC_STATIC double *mechc_fmu_place(mechc_fmu *fmu, uint32_t reference)
{
    const int64_t r = reference;
    if (r < MECHC_OF_STATES) return &fmu->now.t;
    if (r < MECHC_OF_RATES) return &fmu->now.y[r - MECHC_OF_STATES];
    if (r < MECHC_OF_PARAMETERS) return &fmu->rates[r - MECHC_OF_RATES];
    if (r < MECHC_OF_DRIFT) return &fmu->now.p[r - MECHC_OF_PARAMETERS];
    if (r < MECHC_OF_INPUTS) return &fmu->now.drift;
    if (r < MECHC_OF_OUTPUTS)
        return &fmu->now.inputs[mechc_fmu_scene.inputs[r - MECHC_OF_INPUTS]];
    if (r < MECHC_OF_EVENTS) return &fmu->outputs[r - MECHC_OF_OUTPUTS];
    return r < MECHC_REFERENCES ? &fmu->indicators[r - MECHC_OF_EVENTS] : 0;
}

MECHC_STATIC int mechc_fmu_is_evaluated(uint32_t reference)
{
    return mechc_fmu_within(reference, MECHC_OF_RATES, MECHC_OF_PARAMETERS)
        || reference >= MECHC_OF_OUTPUTS;
}

MECHC_STATIC mechc_fmu_status mechc_fmu_get(mechc_fmu *fmu, const uint32_t *references,
                                            size_t count, double *values)
{
    mechc_fmu_current(fmu);
    for (size_t i = 0; i < count; i++) {
        const double *place = mechc_fmu_place(fmu, references[i]);
        if (!place) return mechc_fmu_fails(fmu, "no variable has this value reference");
        if (mechc_fmu_is_evaluated(references[i])) mechc_fmu_evaluate(fmu);
        values[i] = *place;
    }
    return MECHC_FMU_OK;
}

/* Notes what a value given changes; 0 where it cannot be given. */
MECHC_STATIC int mechc_fmu_takes(mechc_fmu *fmu, uint32_t reference)
{
    const int64_t r = reference;
    const int parameter = mechc_fmu_within(r, MECHC_OF_PARAMETERS, MECHC_OF_DRIFT);
    const int state = mechc_fmu_within(r, MECHC_OF_STATES, MECHC_OF_RATES);
    const int input = mechc_fmu_within(r, MECHC_OF_INPUTS, MECHC_OF_OUTPUTS);
    if (parameter && mechc_fmu_scene.calculated[r - MECHC_OF_PARAMETERS]) return 0;
    if (!parameter && !state && !input && r != MECHC_OF_DRIFT) return 0;
    fmu->given_parameters |= parameter;
    fmu->moved |= parameter || state;
    fmu->driven |= input;
    fmu->evaluated = 0;
    return 1;
}

MECHC_STATIC mechc_fmu_status mechc_fmu_set(mechc_fmu *fmu, const uint32_t *references,
                                            size_t count, const double *values)
{
    for (size_t i = 0; i < count; i++) {
        double *place = mechc_fmu_place(fmu, references[i]);
        if (!place || values[i] - values[i] != 0.0)
            return mechc_fmu_fails(fmu, place ? "a value must be finite"
                                              : "no variable has this value reference");
        if (*place == values[i]) continue;
        if (!mechc_fmu_takes(fmu, references[i]))
            return mechc_fmu_fails(fmu, "this variable cannot be set");
        *place = values[i];
    }
    return MECHC_FMU_OK;
}
