/* The unit that runs tapes: a scene that bytes describe, with the general unit that it is linked to.
 *
 * One copy of the shared object serves one scene.  The including file has set MECHC_LANES and MECHC_UNIT. */
#pragma once

#define MECHC_OPENS_TAPES
#ifndef MECHC_UNIT_KEY
#define MECHC_UNIT_KEY ""
#endif

#include "general/bounds.h"
#include "unit/one_by_one.h"
#include "tape/read.h"
#include "simd/bind_scalar.h"
#include "tape/functions.h"
#include "simd/bind_vector.h"
#include "tape/functions.h"
#include "simd/unbind.h"

#if MECHC_KIND_LOOPS
#if MECHC_NI_MAX > 0 /* with inputs loops are not closed finely */
MECHC_STATIC void mechc_extended_read_inputs(long double t, const long double *q, const long double *u,
                                             const void *given, int first, int last, long double *values)
{
    (void)t, (void)q, (void)u, (void)given;
    for (int i = first; i < last; i++) values[i - first] = (long double)NAN;
}
#endif
#include "dynamics/extended.h"
#include "simd/bind_extended.h"
#include "tape/functions.h"
#include "simd/unbind.h"
#endif

/* As tapes say; constant once a scene is open. */
mechc_counts mechc_of_scene;
mechc_series_counts mechc_series_of_scene;

/* A Jacobian of one state, as unit/jacobians.h defines those of a compiled scene. */
MECHC_ONCE void mechc_tape_jacobian_at(const mechc_tape_jacobian *by, int own, double t, const double *q,
                                       const double *u, const mechc_scalar_given *given, double *out)
{
    enum { MOST = MECHC_NX_MAX + MECHC_NP_MAX + MECHC_NI_MAX };
    mechc_scalar_place place;
    double a[MECHC_NU_MAX], l[MECHC_AT_LEAST_ONE(MECHC_NC_MAX)] = {0};
    double residual[MECHC_MOTION_MAX * MOST], response[MECHC_MOTION_MAX * MOST];
    const int columns = by->columns, motion = MECHC_NU + MECHC_NC;
    const size_t numbers = (size_t)(MECHC_OWN * (columns + motion));
    double partials[numbers + 1]; /* as many as a scene has: a bound would be too much for some stacks */
    memset(residual, 0, (size_t)(motion * columns) * sizeof *residual); /* which a tape may leave out */
    memset(partials, 0, numbers * sizeof *partials);
    mechc_scalar_solve(t, q, u, given, &place, a, l);
    mechc_scalar_tape_output(by->residual, t, q, u, given, a, l, residual);
    mechc_scalar_respond(&place, residual, columns, response);
    if (own) {
        mechc_scalar_tape_output(by->own, t, q, u, given, a, l, partials);
        mechc_scalar_follow(partials, response, columns, out);
        return;
    }
    if (by->rates >= 0) mechc_scalar_tape_output(by->rates, t, q, u, given, 0, 0, out);
    else for (int i = 0; i < MECHC_NQ * columns; i++) out[i] = i % columns == by->first + i / columns;
    memcpy(out + MECHC_NQ * columns, response, (size_t)(MECHC_NU * columns) * sizeof *out);
}

/* One state's output of this number. */
static void mechc_tape_evaluate_one(int number, double t, const double *q, const double *u,
                                    const mechc_scalar_given *given, double *out)
{
    const mechc_tape_output *output = mechc_of_tapes.outputs + number;
    mechc_scalar_place place;
    double a[MECHC_NU_MAX], l[MECHC_AT_LEAST_ONE(MECHC_NC_MAX)] = {0};
    switch (output->way) {
    case MECHC_BY_RATES: mechc_scalar_output_rates(t, q, u, given, out); return;
#if MECHC_NC_MAX > 0
    case MECHC_BY_MULTIPLIERS: mechc_scalar_output_multipliers(t, q, u, given, out); return;
#endif
    case MECHC_BY_JACOBIAN:
    case MECHC_BY_OWN_JACOBIAN:
        mechc_tape_jacobian_at(mechc_of_tapes.jacobians + output->tape, output->way == MECHC_BY_OWN_JACOBIAN,
                               t, q, u, given, out);
        return;
#if MECHC_KIND_WALKED
    case MECHC_BY_TREE:
        mechc_scalar_tree_terms(t, q, u, given, output->tape == 2 ? out : 0, output->tape == 0 ? out : 0,
                                output->tape == 1 ? out : 0);
        return;
#endif
    case MECHC_BY_SOLVED: mechc_scalar_solve(t, q, u, given, &place, a, l); break;
    case MECHC_BY_TAPE: break;
    default: return;
    }
    mechc_scalar_tape_output(output->tape, t, q, u, given, a, l, out);
}

/* Functions of its own for each number, as many as there may be. */
#define MECHC_TAPE_EVALUATE(n)                                                                          \
    static void mechc_tape_output_##n(double t, const double *q, const double *u,                       \
                                      const mechc_scalar_given *given, double *out)                     \
    {                                                                                                   \
        mechc_tape_evaluate_one(0x##n, t, q, u, given, out);                                            \
    }                                                                                                   \
    static void mechc_tape_evaluate_##n(ptrdiff_t count, mechc_rows t, mechc_rows y, mechc_rows p,      \
                                        const mechc_inputs *inputs, mechc_rows forces, double *out)     \
    {                                                                                                   \
        mechc_plain_evaluate(mechc_tape_output_##n, mechc_of_tapes.outputs[0x##n].width, count, t, y,   \
                             p, inputs, forces, out);                                                   \
    }
#define MECHC_TAPE_ADDRESS(n) mechc_tape_evaluate_##n,
#define MECHC_OF_SIXTEEN(X, h) \
    X(h##0) X(h##1) X(h##2) X(h##3) X(h##4) X(h##5) X(h##6) X(h##7) \
    X(h##8) X(h##9) X(h##a) X(h##b) X(h##c) X(h##d) X(h##e) X(h##f)
#define MECHC_OF_ALL_OUTPUTS(X) \
    MECHC_OF_SIXTEEN(X, 0) MECHC_OF_SIXTEEN(X, 1) MECHC_OF_SIXTEEN(X, 2) MECHC_OF_SIXTEEN(X, 3) \
    MECHC_OF_SIXTEEN(X, 4) MECHC_OF_SIXTEEN(X, 5) MECHC_OF_SIXTEEN(X, 6) MECHC_OF_SIXTEEN(X, 7)
MECHC_OF_ALL_OUTPUTS(MECHC_TAPE_EVALUATE)
static mechc_evaluate *const mechc_tape_evaluates[MECHC_TAPE_MOST_OUTPUTS] = {
    MECHC_OF_ALL_OUTPUTS(MECHC_TAPE_ADDRESS)};

#if MECHC_KIND_WALKED
static void mechc_tree_mass(double t, const double *y, const mechc_given *given, double *out)
{
    mechc_scalar_output_mass_matrix(t, y, y + MECHC_NQ, (const mechc_scalar_given *)given, out);
}
#endif

static void mechc_tape_mass(double t, const double *y, const mechc_given *given, double *out)
{
    const mechc_scalar_given *own = (const mechc_scalar_given *)given;
    mechc_scalar_tape_output(mechc_of_tapes.named[MECHC_TAPE_NAMED_mass_matrix], t, y, y + MECHC_NQ, own, 0, 0, out);
}

/* Parameters not given take their defaults, which may follow others. */
static void mechc_tape_complete(const unsigned char *given, double *p)
{
    for (int i = 0; i < mechc_of_tapes.default_count; i++) {
        const mechc_tape_default *one = mechc_of_tapes.defaults + i;
        double *arrays[] = {p, p + one->parameter}, none = 0.0;
        if (given[one->parameter]) continue;
        if (one->tape < 0) p[one->parameter] = NAN;
        else mechc_scalar_run_tape(&mechc_of_tapes.code, one->tape, arrays, &none, 0, 0, 0);
    }
}

static mechc_output mechc_tape_output_list[MECHC_TAPE_MOST_OUTPUTS];
static mechc_unit mechc_tape_unit = {
    .instruction_set = MECHC_QUOTE(MECHC_UNIT),
    .lanes = MECHC_LANES, /* of the parts that follow */
    .outputs = mechc_tape_output_list,
    .given_size = sizeof(mechc_scalar_given),
    .give = mechc_plain_give,
    .rates = mechc_plain_rates,
};

static const mechc_unit *mechc_tape_select(const char *instruction_set)
{
    return !instruction_set || !strcmp(instruction_set, MECHC_QUOTE(MECHC_UNIT)) ? &mechc_tape_unit : NULL;
}

extern __attribute__((visibility("hidden"))) const mechc_part mechc_general, mechc_derivatives;
/* The series as its counts say: whether its sums are few, and whether momenta are integrated. */
#if MECHC_TAPES_OF_SERIES
extern __attribute__((visibility("hidden"))) const mechc_part mechc_series_00, mechc_series_01,
    mechc_series_10, mechc_series_11;
static const mechc_part *const mechc_tape_series[2][2] = {
    {&mechc_series_00, &mechc_series_01}, {&mechc_series_10, &mechc_series_11}};
#else
static const mechc_part *const mechc_tape_series[2][2];
#endif
static mechc_model mechc_tape_model;

static mechc_tape_reader mechc_reader;

/* The model of a tape, whose bytes are kept; NULL: `why` says what is wrong with them. */
static const mechc_model *mechc_open_tape(const unsigned char *bytes, size_t size, const char **why)
{
    unsigned char *kept = (unsigned char *)malloc(size ? size : 1);
    *why = "there is no memory for it";
    if (!kept) return NULL;
    memcpy(kept, bytes, size);
    mechc_reader.counts = &mechc_of_scene;
    mechc_reader.series = &mechc_series_of_scene;
    *why = mechc_read_tape(kept, size, &mechc_reader, &mechc_of_tapes);
    if (*why) {
        free(kept);
        return NULL;
    }
    for (int i = 0; i < mechc_of_tapes.output_count; i++) {
        const mechc_tape_output *output = mechc_of_tapes.outputs + i;
        const mechc_output listed = {mechc_of_tapes.names + output->name, output->width, mechc_tape_evaluates[i]};
        mechc_tape_output_list[i] = listed;
    }
    mechc_tape_unit.identity_kinematics = MECHC_IDENTITY_KINEMATICS;
    mechc_tape_unit.output_count = mechc_of_tapes.output_count;
    mechc_tape_unit.mass = mechc_of_tapes.named[MECHC_TAPE_NAMED_mass_matrix] >= 0 ? mechc_tape_mass : NULL;
#if MECHC_KIND_WALKED
    mechc_tape_unit.mass = mechc_tree_mass;
#endif
    const mechc_series_counts *series = &mechc_series_of_scene;
    const mechc_model model = {
        MECHC_ABI, mechc_of_tapes.metadata, MECHC_NQ, MECHC_NU, MECHC_NH, MECHC_NC, MECHC_NP,
        mechc_tape_complete, mechc_tape_select, MECHC_NI, mechc_of_tapes.texts, &mechc_general,
        series->row ? mechc_tape_series[series->few][series->momenta] : NULL,
        mechc_of_scene.varies ? &mechc_derivatives : NULL, MECHC_NX_MAX,
    };
    mechc_tape_model = model;
    return &mechc_tape_model;
}

extern MECHC_SHOWN const mechc_tape_opener mechc_opener;
MECHC_SHOWN const mechc_tape_opener mechc_opener = {MECHC_ABI, MECHC_UNIT_KEY, mechc_open_tape};
