/* Derivatives of a finished run, step by step: the request to a unit. */
#pragma once

#include <stddef.h>
#include "inputs.h"
#include "run.h"

/* Changes of inputs that are functions of time: entry n adds value n of `factors` at each time to how
 * places[n], of parameters and then values of inputs, changes along columns[n]. */
typedef struct {
    int count;
    const int *places, *columns;
    const mechc_inputs *factors;
} mechc_shapes;

/* Columns S of derivatives of the states over the steps first ... last - 1 of a run: along each, the
 * parameters and then the values of inputs change as `directions` says.  Matrices are stored row by
 * row. */
typedef struct {
    const mechc_trajectory *trajectory;
    const double *p;
    const mechc_inputs *inputs;
    ptrdiff_t first, last;
    int columns;
    int restart; /* each step begins with the columns given: the ends are propagators */
    int project; /* the first columns are moved onto the constraints' tangent space before */
    const double *directions; /* (parameters + inputs) x columns */
    const mechc_shapes *shapes; /* or NULL */
    double *ends; /* (last - first + 1) x width x columns; the first of them is given */
    double *rates; /* NULL, or S' where the step's method takes its rates, those of its dense output
                      too: (last - first) x rates x width x columns; all steps by one method */
} mechc_variation;

/* Columns at states of a run, each moved onto the tangent space of the constraints there. */
typedef struct {
    const mechc_trajectory *trajectory; /* whose run it is */
    const double *p;
    const mechc_inputs *inputs;
    ptrdiff_t states;
    const double *t, *y; /* states; states x width */
    int count;
    const double *directions; /* (parameters + inputs) x count */
    const mechc_shapes *shapes; /* or NULL */
    double *columns;          /* states x width x count: moved */
} mechc_projected_columns;

/* The transposed of mechc_variation: how a function of the state at the end of step last - 1 changes with the
 * state at the start of step `first`, and with parameters and inputs. */
typedef struct {
    const mechc_trajectory *trajectory;
    const double *p;
    const mechc_inputs *inputs;
    ptrdiff_t first, last;
    const double *sources; /* added at the start of each step, (last - first) x width; or NULL */
    double *covector;      /* width: at the end, then at the start */
    int columns;           /* parameters and inputs, and those of the shapes behind them */
    const mechc_shapes *shapes; /* or NULL */
    double *gradient;      /* along these: added to */
} mechc_covariation;
