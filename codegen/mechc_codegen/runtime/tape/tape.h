/* A scene as data: its functions as tapes, its outputs, its texts.  read.h makes it of bytes and checks it. */
#pragma once

#include <stdint.h>
#include "tape/operations.h"

typedef struct {
    uint16_t operation, to, a, b, c;
} mechc_operation;

typedef struct {
    int32_t first, count, registers;
} mechc_tape;

enum {
    MECHC_BY_TAPE, MECHC_BY_SOLVED, MECHC_BY_RATES, MECHC_BY_MULTIPLIERS,
    MECHC_BY_JACOBIAN, MECHC_BY_OWN_JACOBIAN /* their `tape` is the number of a Jacobian */
};

typedef struct {
    int32_t way, tape, width, name; /* where the name begins in the names */
} mechc_tape_output;

/* Of a Jacobian by so many columns, of which those from `first` on are the speeds: the tapes of the rates of
 * coordinates, of the residual of the motion, and of the scene's own outputs; -1: not there. */
typedef struct {
    int32_t columns, first, rates, residual, own;
} mechc_tape_jacobian;

typedef struct {
    int32_t parameter, tape; /* of its default; -1: it has none */
} mechc_tape_default;

typedef struct {
    const mechc_operation *operations;
    const double *numbers;
    const mechc_tape *tapes;
    const int32_t *called; /* tapes of the functions before the outputs */
    int32_t constraints, coordinate_rates, kinematic_matrix, switching, mass_matrix; /* likewise, -1: none */
    const mechc_tape_output *outputs;
    const mechc_tape_default *defaults;
    const mechc_tape_jacobian *jacobians;
    const char *names, *metadata, *texts;
    int output_count, default_count;
} mechc_tapes;

static mechc_tapes mechc_of_tapes; /* the one scene that this copy of the unit serves */
