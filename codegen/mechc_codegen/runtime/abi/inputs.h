/* Inputs that are given to a run: numbers, sampled signals, functions that are called back. */
#pragma once

typedef struct mechc_inputs mechc_inputs;

struct mechc_inputs {
    /* Values first .. last - 1 at a time and, where needs_state, a state; q and u may be NULL
     * where nothing needs the state. */
    void (*evaluate)(const mechc_inputs *inputs, int first, int last, double t, const double *q,
                     const double *u, double *values);
    int needs_state;
};
