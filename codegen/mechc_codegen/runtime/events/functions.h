/* The functions of events, compiled from expressions of time, state and parameters. */
#pragma once

#define MECHC_EVENTS_ABI 3

typedef struct {
    double (*value)(double t, const double *y, const double *p); /* zero at the event */
    /* Derivatives of the value by t, and by each component of y. */
    void (*slopes)(double t, const double *y, const double *p, double *slopes);
    /* The state after a reset, before it is put onto the constraints.  NULL: none. */
    void (*reset)(double t, const double *y, const double *p, double *after);
    /* Of a stop, whose gap is the value: how much of the speed of approach it gives back.  NULL: it
     * is none. */
    double (*restitution)(double t, const double *y, const double *p);
    int poisson; /* of a stop: by Poisson's law of restitution, not Newton's */
} mechc_event_functions;

/* What one compiled unit offers, under the name mechc_events. */
typedef struct {
    int abi, width, parameters, count;
    const mechc_event_functions *functions;
} mechc_event_unit;
