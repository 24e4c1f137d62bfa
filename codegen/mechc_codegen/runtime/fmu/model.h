/* The generated data of a functional mock-up unit (FMI 2.0 and 3.0) of one scene. */
#pragma once

#include <stddef.h>
#include "hybrid/reach.h"

typedef struct {
    const char *token;   /* of the model's description; an importer has to supply it */
    int method;          /* mechc_method_number that co-simulation begins with */
    double rtol, drift;  /* tolerance of co-simulation; least drift, over the scale, to project */
    const double *y, *p; /* at which a model starts */
    const unsigned char *calculated;   /* of each parameter: does it follow others? */
    void (*complete)(double *p);       /* parameters that follow others */
    void (*follow)(const double *p, double *along); /* how they follow along a direction */
    const unsigned char *dimensionless; /* of each component of a state: it contains no length */
    int length_count;
    const int *lengths;  /* parameters that are lengths */
    int input_count;
    const int *inputs;   /* the places of inputs among the input values of a run */
    const mechc_event_functions *events; /* NULL: none */
    const mechc_event_policy *policy; /* of each */
    mechc_contact_laws contacts; /* none: their count is 0 */
} mechc_fmu_model;

extern const mechc_fmu_model mechc_fmu_scene; /* in the generated file */
