/* The functions of events, and the laws of contacts, of time, state and parameters: compiled from
 * expressions, or functions of the caller's. */
#pragma once

#define MECHC_EVENTS_ABI 4

typedef struct {
    double (*value)(void *context, double t, const double *y, const double *p); /* zero at the event */
    /* Derivatives of the value by t, and by each component of y; NULL: by differences. */
    void (*slopes)(void *context, double t, const double *y, const double *p, double *slopes);
    /* The state, and then the parameters, after a reset, before the state is put onto the constraints;
     * they come in as they are before it.  0 where it fails.  NULL: none. */
    int (*reset)(void *context, double t, const double *y, const double *p, double *after);
    void *context;
} mechc_event_functions;

/* The quantities of n contacts at (t, state = q, u, q'), a row of MECHC_LAWS + nq + nu each: gap, its
 * rate, the part of its acceleration that is not linear in q'', slip, the part of its rate without u',
 * restitution, friction, static friction, slopes of the gap by q, rows of the slip over u.  0 where
 * they fail. */
typedef int (*mechc_contact_table)(void *context, double t, const double *state, const double *p,
                                double *table);
enum {
    MECHC_GAP, MECHC_RATE, MECHC_BEND, MECHC_SLIP, MECHC_DRIFT, MECHC_RESTITUTION, MECHC_FRICTION,
    MECHC_STICTION, MECHC_LAWS
};

/* What one compiled unit offers, under the name mechc_events. */
typedef struct {
    int abi, width, parameters, count;
    const mechc_event_functions *functions;
    mechc_contact_table contacts; /* NULL: none */
} mechc_event_unit;
