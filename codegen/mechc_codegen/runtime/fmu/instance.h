/* One instance of the unit: values by their references, evaluated on request.
 *
 * References: time, states, their rates, parameters, the least drift, inputs, outputs, events. */
#pragma once

#include <stdint.h>
#include <stdlib.h>
#include "fmu/outputs.h"
#include "fmu/model.h"
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

/* The result of a call, by the numbers that both versions of FMI use. */
typedef enum { MECHC_FMU_OK = 0, MECHC_FMU_DISCARD = 2, MECHC_FMU_ERROR = 3 } mechc_fmu_status;

/* All values from which a motion can continue. */
typedef struct {
    double t, rtol, drift;
    double y[MECHC_NX_MAX], p[MECHC_AT_LEAST_ONE(MECHC_NP_MAX)], inputs[MECHC_AT_LEAST_ONE(MECHC_NI_MAX)];
    double side[MECHC_AT_LEAST_ONE(MECHC_FMU_EVENTS)]; /* the sign that each event has after it */
    unsigned char away[MECHC_AT_LEAST_ONE(MECHC_FMU_EVENTS)]; /* not seen there since its reset */
} mechc_moment;

typedef void mechc_fmu_logger(void);
typedef struct mechc_fmu mechc_fmu;
struct mechc_fmu {
    mechc_moment now;
    int given_parameters; /* since `model` was made of them */
    int moved;            /* time, state or parameters were set: a run begins anew */
    int driven;           /* inputs were given: a run goes on with others */
    int evaluated;        /* rates and outputs are those of `now` */
    mechc_standalone model;
    double rates[MECHC_NX_MAX], outputs[MECHC_AT_LEAST_ONE(MECHC_FMU_VALUES)];
    double indicators[MECHC_AT_LEAST_ONE(MECHC_FMU_EVENTS)];
    mechc_reacher reacher; /* the motion of co-simulation, which may be ahead */
    double reached[MECHC_NX_MAX];
    /* The inputs as it takes them: constants. */
    mechc_given_inputs given;
    mechc_driven driven_by;
    mechc_signal signals[MECHC_AT_LEAST_ONE(MECHC_NI_MAX)];
    mechc_source sources[MECHC_AT_LEAST_ONE(MECHC_NI_MAX)];
    ptrdiff_t knots[MECHC_AT_LEAST_ONE(MECHC_NI_MAX)];
    void *environment;
    void (*say)(const mechc_fmu *fmu, mechc_fmu_status status, const char *message);
    mechc_fmu_logger *logger; /* the importer's, of the version's type */
    char *name;
};

MECHC_STATIC mechc_fmu_status mechc_fmu_fails(const mechc_fmu *fmu, const char *message)
{
    if (fmu->say) fmu->say(fmu, MECHC_FMU_ERROR, message); /* errors are no debug logging */
    return MECHC_FMU_ERROR;
}

/* Set all values to those that an instance begins with. */
MECHC_STATIC void mechc_fmu_reset(mechc_fmu *fmu)
{
    const mechc_fmu_model *scene = &mechc_fmu_scene;
    memset(&fmu->now, 0, sizeof fmu->now);
    memcpy(fmu->now.y, scene->y, MECHC_NX * sizeof *scene->y);
    if (MECHC_NP > 0) memcpy(fmu->now.p, scene->p, MECHC_NP * sizeof *scene->p);
    fmu->now.rtol = scene->rtol;
    fmu->now.drift = scene->drift;
    fmu->given_parameters = fmu->moved = 1;
    fmu->driven = fmu->evaluated = 0;
}

/* Allocate the motion; 0 without memory. */
MECHC_STATIC int mechc_fmu_make_motion(mechc_fmu *fmu)
{
    const mechc_fmu_model *scene = &mechc_fmu_scene;
    mechc_hybrid *hybrid = &fmu->reacher.hybrid;
    static const double from = 0.0; /* the knot of a constant */
    for (int i = 0; i < MECHC_NI; i++) {
        fmu->signals[i] = (mechc_signal){.knots = &from, .coefficients = fmu->now.inputs + i};
        fmu->sources[i].signal = fmu->signals + i;
        fmu->knots[i] = 1;
    }
    fmu->driven_by.head.evaluate = mechc_driven_evaluate;
    fmu->driven_by.sources = fmu->sources;
    fmu->given = (mechc_given_inputs){
        .driven = &fmu->driven_by, .signals = fmu->signals, .knots = fmu->knots,
        .signal_count = MECHC_NI, .source_count = MECHC_NI,
    };
    hybrid->motion.unit = &MECHC_UNIT_TABLE;
    hybrid->motion.coordinates = MECHC_NQ;
    hybrid->motion.speeds = MECHC_NU;
    hybrid->motion.rows = MECHC_NC;
    hybrid->motion.parameters = MECHC_NP;
    hybrid->motion.sizes.dimensionless = scene->dimensionless;
    hybrid->motion.sizes.lengths = scene->lengths;
    hybrid->motion.sizes.length_count = scene->length_count;
    hybrid->given = MECHC_NI > 0 ? &fmu->given : 0;
    hybrid->contacts.laws = scene->contacts;
    hybrid->max_bytes = HUGE_VAL;
    fmu->reacher.y = fmu->reached;
    fmu->reacher.ahead = MECHC_NH > 0 || MECHC_FMU_EVENTS > 0;
    if (!mechc_hybrid_make(hybrid, MECHC_FMU_EVENTS)) return 0;
    for (int k = 0; k < MECHC_FMU_EVENTS; k++) {
        hybrid->watch.functions[k] = scene->events[k];
        hybrid->watch.policy[k] = scene->policy[k];
    }
    return 1;
}

MECHC_STATIC void mechc_fmu_free(mechc_fmu *fmu)
{
    if (!fmu) return;
    mechc_hybrid_free(&fmu->reacher.hybrid);
    free(fmu->name);
    free(fmu);
}

/* Create an instance; NULL without memory, or if the token belongs to another description. */
MECHC_STATIC mechc_fmu *mechc_fmu_make(const char *name, const char *token)
{
    if (!token || strcmp(token, mechc_fmu_scene.token)) return 0;
    mechc_fmu *fmu = calloc(1, sizeof *fmu);
    if (!fmu) return 0;
    const size_t room = name ? strlen(name) + 1 : 1;
    fmu->name = calloc(1, room);
    if (!fmu->name || !mechc_fmu_make_motion(fmu)) {
        mechc_fmu_free(fmu);
        return 0;
    }
    if (name) memcpy(fmu->name, name, room);
    mechc_fmu_reset(fmu);
    return fmu;
}

/* The model with the present parameters and inputs. */
MECHC_STATIC mechc_standalone *mechc_fmu_current(mechc_fmu *fmu)
{
    const int anew = fmu->given_parameters;
    if (anew) {
        mechc_fmu_scene.complete(fmu->now.p);
        mechc_standalone_set(&fmu->model, fmu->now.p, fmu->now.t, fmu->now.y);
        fmu->given_parameters = 0;
    }
    if (MECHC_NI > 0) memcpy(fmu->model.inputs, fmu->now.inputs, MECHC_NI * sizeof *fmu->now.inputs);
    if (MECHC_ROWS_HOLD_INPUTS && anew) mechc_standalone_begin(&fmu->model, fmu->now.t, fmu->now.y);
    return &fmu->model;
}

/* The motion with the present parameters; `scale` has the size of each component of the state. */
MECHC_STATIC mechc_motion *mechc_fmu_motion(mechc_fmu *fmu)
{
    mechc_motion *motion = &fmu->reacher.hybrid.motion;
    mechc_fmu_current(fmu);
    memcpy(motion->p, fmu->now.p, (size_t)MECHC_NP * sizeof *motion->p);
    motion->inputs = MECHC_NI > 0 ? &fmu->reacher.hybrid.inputs.whole.head : 0;
    motion->rtol = fmu->now.rtol;
    motion->sense = 1.0;
    motion->rates = mechc_free_rates;
    mechc_motion_renew(motion);
    return motion;
}

/* Close the loops at the nearest state.  The constraints that count are determined there. */
MECHC_STATIC int mechc_fmu_close(mechc_fmu *fmu)
{
    const int status = mechc_standalone_project(mechc_fmu_current(fmu), fmu->now.t, fmu->now.y);
    fmu->given_parameters = 1;
    fmu->evaluated = 0;
    mechc_fmu_current(fmu);
    return status;
}

/* Evaluate the function of each event; for dry friction the speed of sliding. */
MECHC_STATIC void mechc_fmu_evaluate_events(mechc_fmu *fmu)
{
    const mechc_contact_laws *laws = &mechc_fmu_scene.contacts;
    const double t = fmu->now.t, *p = fmu->now.p;
    double state[MECHC_NX_MAX + MECHC_NQ_MAX];
    double table[MECHC_AT_LEAST_ONE(MECHC_FMU_CONTACTS) * (MECHC_LAWS + MECHC_NX_MAX)];
    memcpy(state, fmu->now.y, MECHC_NX * sizeof *state);
    memcpy(state + MECHC_NX, fmu->rates, MECHC_NQ * sizeof *state);
    const int has_laws = MECHC_FMU_CONTACTS > 0 && laws->table(laws->context, t, state, p, table);
    for (int k = 0; k < MECHC_FMU_EVENTS; k++) {
        const mechc_event_functions *event = mechc_fmu_scene.events + k;
        const int contact = mechc_fmu_scene.policy[k].contact;
        if (event->value) fmu->indicators[k] = event->value(event->context, t, fmu->now.y, p);
        else fmu->indicators[k] = has_laws ? table[contact * (MECHC_LAWS + MECHC_NX) + MECHC_SLIP] : NAN;
    }
}

MECHC_STATIC void mechc_fmu_evaluate(mechc_fmu *fmu)
{
    if (fmu->evaluated) return;
    double *out = fmu->outputs, forces[MECHC_NU_MAX];
    const double t = fmu->now.t, *y = fmu->now.y;
    mechc_hybrid *hybrid = &fmu->reacher.hybrid;
    mechc_held held;
    mechc_scalar_given given;
    mechc_give_standalone(mechc_fmu_current(fmu), &held, &given);
    if (mechc_has_contacts(hybrid) && hybrid->live && !fmu->moved
        && mechc_is_in_contact(&hybrid->motion)) { /* with the forces of lasting ones */
        mechc_contact_forces(hybrid->motion.contacts, t, y, forces);
        given.forces = forces;
    }
    mechc_scalar_output_rates(t, y, y + MECHC_NQ, &given, fmu->rates);
#define MECHC_FMU_EVALUATE(label, width) \
    mechc_scalar_output_##label(t, y, y + MECHC_NQ, &given, out), out += width;
    MECHC_FMU_OUTPUTS(MECHC_FMU_EVALUATE)
    (void)out;
    mechc_fmu_evaluate_events(fmu);
    fmu->evaluated = 1;
}

/* Whether a reference is in a range, which may be empty. */
MECHC_INLINE int mechc_fmu_within(int64_t reference, int first, int after)
{
    return reference >= first && reference < after;
}

/* The place where the value of a reference is stored; NULL: none. */
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

MECHC_STATIC mechc_fmu_status mechc_fmu_get(mechc_fmu *fmu, const uint32_t *references,
                                            size_t count, double *values)
{
    mechc_fmu_current(fmu);
    for (size_t i = 0; i < count; i++) {
        const double *place = mechc_fmu_place(fmu, references[i]);
        if (!place) return mechc_fmu_fails(fmu, "no variable has this value reference");
        const int rate = mechc_fmu_within(references[i], MECHC_OF_RATES, MECHC_OF_PARAMETERS);
        if (rate || references[i] >= MECHC_OF_OUTPUTS) mechc_fmu_evaluate(fmu);
        values[i] = *place;
    }
    return MECHC_FMU_OK;
}

/* Note the changes that setting a value causes; 0 if it cannot be set. */
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
