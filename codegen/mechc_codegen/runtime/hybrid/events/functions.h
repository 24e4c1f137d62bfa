/* Functions of events and laws of contacts, of time, state and parameters: made of expressions, or supplied by
 * the caller. */
#pragma once

typedef struct {
    double (*value)(void *context, double t, const double *y, const double *p); /* zero at the event */
    /* derivatives of the value by t, and by each component of y; NULL: by differences */
    void (*slopes)(void *context, double t, const double *y, const double *p, double *slopes);
    /* Overwrites the state and then the parameters with those after the reset, before projection.
       Returns 0 on failure.  NULL: no reset. */
    int (*reset)(void *context, double t, const double *y, const double *p, double *after);
    void *context;
} mechc_event_functions;

/* The quantities of n contacts at (t, state = q, u, q'), one row of MECHC_LAWS + nq + nu each: gap,
 * its rate, the part of its acceleration that is not linear in q'', slip, the part of its rate
 * without u', restitution, friction, static friction, slopes of the gap by q, rows of the slip over
 * u.  Returns 0 on failure. */
typedef int (*mechc_contact_table)(void *context, double t, const double *state, const double *p,
                                double *table);
enum {
    MECHC_GAP, MECHC_RATE, MECHC_BEND, MECHC_SLIP, MECHC_DRIFT, MECHC_RESTITUTION, MECHC_FRICTION,
    MECHC_STICTION, MECHC_LAWS
};
