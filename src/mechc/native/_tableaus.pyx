# cython: language_level=3, boundscheck=False, wraparound=False, initializedcheck=False
"""The tableaus of explicit pairs."""

import numpy as np

cdef extern from "abi/codes.h":
    pass

cdef extern from "methods/dormand_prince_tableaus.h":
    int MECHC_MOST_RATES
    double MECHC_SHARE, MECHC_SHARE_OF_MANY

    ctypedef struct mechc_tableau:
        int stages, rates, dense_rows, order
        double share
        const double *nodes
        const double *matrix
        const double *dense
        const double *error
        const double *second_error

cdef extern from *:
    """
    typedef struct { const char *name; const mechc_tableau *tableau; } mechc_pair_row;
    #define MECHC_PAIR_ROW_PAIR(name) {#name, &mechc_##name##_tableau},
    #define MECHC_PAIR_ROW_GAUSS(name)
    #define MECHC_PAIR_ROW_RADAU(name)
    #define MECHC_PAIR_ROW(name, NUMBER, number, PART, degree, RULE, ...) MECHC_PAIR_ROW_##RULE(name)
    static const mechc_pair_row mechc_pairs[] = {MECHC_METHOD_TABLE(MECHC_PAIR_ROW)};
    enum { mechc_pair_count = sizeof mechc_pairs / sizeof *mechc_pairs };
    """
    ctypedef struct mechc_pair_row:
        const char *name
        const mechc_tableau *tableau

    const mechc_pair_row mechc_pairs[]
    int mechc_pair_count


cdef tuple _arrays_of(const mechc_tableau *tableau):
    cdef int i, j, rates = tableau.rates, extra = tableau.dense_rows - 3
    nodes = np.array([tableau.nodes[i] for i in range(rates)])
    matrix = np.zeros((rates, rates))
    for i in range(rates):
        for j in range(i):
            matrix[i, j] = tableau.matrix[i * MECHC_MOST_RATES + j]
    dense = [[tableau.dense[i * MECHC_MOST_RATES + j] for j in range(rates)] for i in range(extra)]
    errors = [[tableau.error[j] for j in range(tableau.stages + 1)]]
    if tableau.second_error != NULL:
        errors.append([tableau.second_error[j] for j in range(tableau.stages + 1)])
    measures = tableau.order, tableau.share
    return tableau.stages, nodes, matrix, np.array(dense), np.array(errors), *measures


# Method: the rate at the step's end, nodes, matrix (rates, rates), rows of the dense output, of one
# or two estimates of the error the weights of the rates up to that of the end, order, share of the
# tolerance for one step.
PAIRS = {mechc_pairs[i].name.decode(): _arrays_of(mechc_pairs[i].tableau) for i in range(mechc_pair_count)}
SHARE, SHARE_OF_MANY = MECHC_SHARE, MECHC_SHARE_OF_MANY
