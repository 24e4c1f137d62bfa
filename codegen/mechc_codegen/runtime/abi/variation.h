/* Derivatives of a finished run, step by step: what is asked of a unit. */
#pragma once

#include <stddef.h>
#include "inputs.h"
#include "run.h"

/* Columns S of derivatives of the states over the steps first ... last - 1 of a run: along each, the
 * parameters and then the values of inputs change as `directions` says.  Matrices are stored row by
 * row. */
typedef struct {
    const mechc_trajectory *trajectory;
    const double *p;
    const mechc_inputs *inputs;
    ptrdiff_t first, last;
    int columns;
    const double *directions; /* (parameters + inputs) x columns */
    double *ends; /* (last - first + 1) x width x columns; the first of them is given */
    double *rates; /* NULL, or S' where the step's method takes its rates, those of its dense output
                      too: (last - first) x rates x width x columns; all steps by one method */
} mechc_variation;
