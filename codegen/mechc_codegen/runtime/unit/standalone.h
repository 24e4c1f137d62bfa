/* A scene as plain C: what an exported file offers, for one state at a time.
 *
 * The exported file declares it in its own header, where MECHC_PUBLIC(name) is a public name and
 * mechc_standalone the type of a model: parameters, constants made of them, values of inputs.
 * MECHC_COMPLETE(p) calculates the parameters that follow others and were not set. */
#pragma once

#include <string.h>
#include "singularities/generic_rank.h"
#include "unit/assemble.h"
#include "unit/scalar_outputs.h"

#ifndef MECHC_ROWS_HOLD_INPUTS
#define MECHC_ROWS_HOLD_INPUTS 0 /* do values of inputs stand in the constraints? */
#endif

#ifndef MECHC_PUBLIC
#define MECHC_PUBLIC(name) mechc_standalone_##name
#define MECHC_COMPLETE(p) ((void)(p)) /* they are given complete */
typedef struct {
    double p[MECHC_AT_LEAST_ONE(MECHC_NP_MAX)], k[MECHC_CONSTANTS_MAX];
    double inputs[MECHC_AT_LEAST_ONE(MECHC_NI_MAX)];
    void (*drive)(void *data, double t, const double *q, const double *u, double *inputs);
    void *data;
} mechc_standalone;
int MECHC_PUBLIC(set)(mechc_standalone *model, const double *p, double t, const double *y);
void MECHC_PUBLIC(begin)(mechc_standalone *model, double t, const double *y);
int MECHC_PUBLIC(project)(const mechc_standalone *model, double t, double *y);
int MECHC_PUBLIC(assemble)(const mechc_standalone *model, double t, double *y,
                           const unsigned char *held);
double MECHC_PUBLIC(conditioning)(const mechc_standalone *model, double t, const double *y);
int MECHC_PUBLIC(step)(const mechc_standalone *model, double t, double h, double *y);
#endif

/* A model has the sizes that are written to it: it does not compile otherwise. */
typedef char mechc_sizes_of_standalone
    [sizeof(((mechc_standalone *)0)->p) == MECHC_AT_LEAST_ONE(MECHC_NP_MAX) * sizeof(double)
             && sizeof(((mechc_standalone *)0)->k) == MECHC_CONSTANTS_MAX * sizeof(double)
             && sizeof(((mechc_standalone *)0)->inputs)
                    == MECHC_AT_LEAST_ONE(MECHC_NI_MAX) * sizeof(double)
         ? 1 : -1];

/* Inputs with constant values, or values by a function of the program. */
typedef struct {
    mechc_inputs head; /* first: it is what the scene is given */
    const double *values;
    const mechc_standalone *model; /* of that function */
} mechc_held;

MECHC_STATIC void mechc_held_values(const mechc_inputs *inputs, int first, int last, double t,
                                    const double *q, const double *u, double *values)
{
    const mechc_held *held = (const mechc_held *)inputs;
    (void)t, (void)q, (void)u;
    for (int i = first; i < last; i++) values[i - first] = held->values[i];
}

MECHC_STATIC void mechc_values_at(const mechc_inputs *inputs, int first, int last, double t,
                                  const double *q, const double *u, double *values)
{
    const mechc_held *held = (const mechc_held *)inputs;
    double all[MECHC_AT_LEAST_ONE(MECHC_NI_MAX)];
    memcpy(all, held->model->inputs, sizeof held->model->inputs);
    held->model->drive(held->model->data, t, q, u, all);
    for (int i = first; i < last; i++) values[i - first] = all[i];
}

MECHC_STATIC mechc_held mechc_inputs_of(const mechc_standalone *model)
{
    return (mechc_held){
        {model->drive ? mechc_values_at : mechc_held_values, model->drive != 0}, model->inputs, model};
}

/* Set the arguments of the scene's functions; `held` has the lifetime of the result. */
MECHC_STATIC void mechc_give_standalone(const mechc_standalone *model, mechc_held *held,
                                        mechc_scalar_given *given)
{
    *held = mechc_inputs_of(model);
    memcpy(given->p, model->p, sizeof model->p);
    memcpy(given->k, model->k, sizeof model->k);
    given->inputs[0] = &held->head;
    given->stop = 0;
    given->forces = 0;
    given->count = mechc_rows_of_state;
}

MECHC_STATIC int mechc_all_finite(const double *values, int count)
{
    int finite = 1;
    for (int i = 0; i < count; i++) finite &= values[i] - values[i] == 0.0;
    return finite;
}

/* Set the constants: those made of parameters, and where rows `count` those that a state on them tells. */
MECHC_STATIC void mechc_make_standalone(mechc_standalone *model, double t, const double *y, int count)
{
    const mechc_held held = mechc_inputs_of(model);
    mechc_scalar_given given;
    mechc_give(model->p, &held.head, &given);
    if (count) mechc_know_rows(t, y, &given);
    memcpy(model->k, given.k, sizeof given.k);
}

/* Without inputs that stand in the constraints all rows count until a state on them can be known. */
int MECHC_PUBLIC(set)(mechc_standalone *model, const double *p, double t, const double *y)
{
    double complete[MECHC_AT_LEAST_ONE(MECHC_NP_MAX)] = {0.0};
    for (int i = 0; i < MECHC_NP; i++) complete[i] = p[i]; /* which may be those of the model */
    MECHC_COMPLETE(complete);
    memset(model, 0, sizeof *model);
    memcpy(model->p, complete, sizeof model->p);
    mechc_make_standalone(model, t, y, !MECHC_ROWS_HOLD_INPUTS);
    return mechc_all_finite(model->p, MECHC_NP) ? MECHC_RUNNING : MECHC_NOT_FINITE;
}

void MECHC_PUBLIC(begin)(mechc_standalone *model, double t, const double *y)
{
    mechc_make_standalone(model, t, y, 1);
}

int MECHC_PUBLIC(project)(const mechc_standalone *model, double t, double *y)
{
    mechc_held held;
    mechc_scalar_given given;
    double moved[2];
    mechc_give_standalone(model, &held, &given);
    return mechc_project_state(t, y, &given, moved);
}

int MECHC_PUBLIC(assemble)(const mechc_standalone *model, double t, double *y,
                           const unsigned char *held)
{
    mechc_held inputs;
    mechc_scalar_given given;
    double moved[2];
    mechc_give_standalone(model, &inputs, &given);
    const int status = mechc_assemble_beside(t, y, &given, held);
    return status == MECHC_RUNNING ? mechc_project_state(t, y, &given, moved) : status;
}

double MECHC_PUBLIC(conditioning)(const mechc_standalone *model, double t, const double *y)
{
#if MECHC_NC_MAX > 0
    mechc_held held;
    mechc_scalar_given given;
    mechc_scalar_place place;
    mechc_give_standalone(model, &held, &given);
    mechc_locate(t, y, &given, &place);
    return mechc_scalar_conditioning(&place);
#else
    (void)model, (void)t, (void)y;
    return 1.0;
#endif
}

/* One step of Kutta's method of order 4; its end is moved to the nearest state on the constraints. */
int MECHC_PUBLIC(step)(const mechc_standalone *model, double t, double h, double *y)
{
    static const double node[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0, 2.0, 2.0, 1.0};
    mechc_held held;
    mechc_scalar_given given;
    double stage[MECHC_NX_MAX], rates[MECHC_NX_MAX] = {0.0}, end[MECHC_NX_MAX], moved[2];
    mechc_give_standalone(model, &held, &given);
    memcpy(end, y, MECHC_NX * sizeof *y);
    for (int s = 0; s < 4; s++) {
        for (int i = 0; i < MECHC_NX; i++) stage[i] = y[i] + h * node[s] * rates[i];
        mechc_scalar_output_rates(t + h * node[s], stage, stage + MECHC_NQ, &given, rates);
        for (int i = 0; i < MECHC_NX; i++) end[i] += h / 6.0 * weight[s] * rates[i];
    }
    if (!mechc_all_finite(end, MECHC_NX)) return MECHC_NOT_FINITE;
    const int status = mechc_project_state(t + h, end, &given, moved);
    if (status == MECHC_RUNNING) memcpy(y, end, MECHC_NX * sizeof *y);
    return status;
}

#define MECHC_DEFINE_STANDALONE(label, name, width)                                               \
    void MECHC_PUBLIC(label)(const mechc_standalone *model, double t, const double *y,            \
                             double *out)                                                         \
    {                                                                                             \
        mechc_held held;                                                                          \
        mechc_scalar_given given;                                                                 \
        mechc_give_standalone(model, &held, &given);                                              \
        mechc_scalar_output_##label(t, y, y + MECHC_NQ, &given, out);                             \
    }
MECHC_OUTPUTS(MECHC_DEFINE_STANDALONE)
MECHC_SOLVED_OUTPUTS(MECHC_DEFINE_STANDALONE)
