# cython: language_level=3, boundscheck=False, wraparound=False, initializedcheck=False
"""The tableaus of explicit pairs."""

import numpy as np

cdef extern from "methods/dormand_prince_tableaus.h":
    int MECHC_MOST_RATES

    ctypedef struct mechc_tableau:
        int stages, rates, dense_rows
        const double *nodes
        const double *matrix
        const double *dense
        const double *error
        const double *second_error

    const mechc_tableau mechc_dopri5_tableau, mechc_dop853_tableau


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
    return tableau.stages, nodes, matrix, np.array(dense), np.array(errors)


# Method: the rate at the step's end, nodes, matrix (rates, rates), rows of the dense output, of one
# or two estimates of the error the weights of the rates up to that of the end.
PAIRS = {"dopri5": _arrays_of(&mechc_dopri5_tableau), "dop853": _arrays_of(&mechc_dop853_tableau)}
