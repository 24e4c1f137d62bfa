/* A scene as data: its functions as tapes, its outputs, its texts.  read.h makes it of bytes and checks it. */
#pragma once

#include <stdint.h>
#include "simd/lookup.h"
#include "tape/operations.h"

typedef struct {
    uint16_t operation, to, a, b, c;
} mechc_operation;

typedef struct {
    int32_t first, count, registers;
} mechc_tape;

/* A derivative of a table: of each axis the order, the number of pieces, and where their starts and then
 * the period begin among the numbers of tables. */
typedef struct {
    int32_t axis_count, degree, order[2], pieces[2], starts[2], coefficients;
} mechc_tape_table;

/* What a tape is run with. */
typedef struct {
    const mechc_operation *operations;
    const mechc_tape *tapes;
    const mechc_tape_table *tables;
    const double *numbers, *of_tables;
} mechc_tape_code;

enum {
    MECHC_BY_TAPE, MECHC_BY_SOLVED, MECHC_BY_RATES, MECHC_BY_MULTIPLIERS,
    MECHC_BY_JACOBIAN, MECHC_BY_OWN_JACOBIAN, /* their `tape` is the number of a Jacobian */
    MECHC_BY_TREE /* mass matrix, forcing, rows of a tree that is walked: 0, 1, 2 */
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
    mechc_tape_code code;
    const int32_t *called; /* tapes of the functions before the outputs */
    const int32_t *named;  /* of MECHC_TAPE_NAMED, -1: none */
    const mechc_tape_output *outputs;
    const mechc_tape_default *defaults;
    const mechc_tape_jacobian *jacobians;
    const char *names, *metadata, *texts;
    int output_count, default_count;
} mechc_tapes;

/* The one scene that this copy of the unit serves. */
static mechc_tapes mechc_of_tapes __attribute__((unused));
