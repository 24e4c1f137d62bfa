/* Sizes of a scene's Taylor series, for the series that tapes compute. */
#pragma once

#include "dynamics/given.h"
#include "general/called.h"

typedef struct {
    int row, sums, kept, integrated, hides, root_count, few, momenta;
    const int *roots; /* places in a row */
    const int *left, *right; /* places of the factors of each sum */
} mechc_series_counts;

#ifdef MECHC_OPENS_TAPES
extern __attribute__((visibility("hidden"))) mechc_series_counts mechc_series_of_scene;
#else
extern __attribute__((visibility("hidden"))) const mechc_series_counts mechc_series_of_scene;
#endif

/* Its parts that are linear. */
extern MECHC_OF_SCENE void mechc_scalar_series_start(double t, const double *q, const double *u,
                                                     const mechc_scalar_given *given, double *kept,
                                                     double *row, double *rates);
extern MECHC_OF_SCENE void mechc_scalar_series_next(double order, double inverse, double time,
                                                    const mechc_scalar_given *given, const double *kept,
                                                    const double *sums, double *row, double *rates);
extern MECHC_OF_SCENE void mechc_scalar_series_solve(const mechc_scalar_given *given, const double *kept,
                                                     const double *sums, double *row);
