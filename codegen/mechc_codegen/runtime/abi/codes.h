/* Numbers that compiled code and its callers share: each is written here, once. */
#pragma once

/* Components of a state up to which work space is below half a megabyte and a step is short; wider
 * scenes work on a stack of their own, and a step that has begun can be given up. */
#define MECHC_WIDE 64

/* The result of a run, or of the projection of one state. */
typedef enum {
    MECHC_RUNNING = 0,
    MECHC_FINISHED = 1,
    MECHC_NOT_CLOSED = 2,      /* the loops cannot be closed near this state */
    MECHC_STEP_TOO_SMALL = 3,  /* the step shrank to the spacing of doubles */
    MECHC_NOT_FINITE = 4,      /* NaN or infinity */
    MECHC_SINGULAR_MASS = 5,   /* mass matrix not positive definite; stats.coordinate */
    MECHC_TOO_MANY_STEPS = 6,
    MECHC_NO_MEMORY = 7,
    MECHC_UNDECIDED = 8,       /* a gap so small that doubles cannot tell which way it bends */
    MECHC_AT_CHANGE_POINT = 9, /* the start is a change point: two ways lead on from it */
    MECHC_STOPPED_AT_CHANGE_POINT = 10, /* as asked for; the crossing is recorded, not the step */
    MECHC_NO_STEP_FITS = 12,      /* none could be placed across a crossing */
    MECHC_BRANCH_IN_DOUBT = 13,   /* the weak directions were lost, however short the step */
    MECHC_BEND_TOO_SHARP = 14,    /* a near miss, in whose bend the steps shrank to nothing */
    MECHC_CHATTERS = 15           /* steps go to and fro across a jump to which both sides lead back */
} mechc_status;

/* The result of a run, or of a member of a batch, where its driver decides it. */
typedef enum {
    MECHC_NOT_RUN = 0,
    MECHC_NEARLY_DEPENDENT = 11, /* the constraints, where no crossing is looked for */
    MECHC_INTERRUPTED = 108,
    MECHC_STOPPED_BY_EVENT = 109,
    MECHC_EVENT_FAILED = 110, /* the function of an event */
    MECHC_OPEN_AT_START = 111,
    MECHC_NOT_ASSEMBLED = 112,
    MECHC_INPUT_FAILED = 113, /* the function of an input */
    MECHC_MEMORY_LIMIT = 114, /* as many accepted states as were allowed */
    MECHC_DISCONTINUITY = 115, /* the rates jump where the steps shrank to nothing */
    MECHC_RESETS_ACCUMULATE = 116, /* an event resets the state ever more often */
    MECHC_CONTACT_INCONSISTENT = 117, /* no mode of contact satisfies the laws */
    MECHC_CONTACT_UNDECIDED = 118, /* several do, or modes change without end at one instant */
    MECHC_CONTACTS_TOO_MANY = 119, /* more modes than are tried */
    MECHC_END_OF_REACH = 120 /* of links that prescribed motion drives */
} mechc_driver_status;

/* How derivatives follow the steps of a method: by collocation along its dense output, or by its stages. */
typedef enum {
    MECHC_RULE_GAUSS = 0,
    MECHC_RULE_RADAU = 1,
    MECHC_RULE_PAIR = 2
} mechc_derivative_rule;

/* Integration methods, mechc_options.method: name, number, part of a unit that has their code
 * (parts.h), degree of a polynomial through the ends of steps that tells no step from its own end,
 * rule of derivatives and whether all states that it takes them at are put onto the constraints,
 * method whose code takes several such runs in the lanes. */
#define MECHC_METHOD_TABLE(X) \
    X(dopri5, DOPRI5, 0, EXPLICIT, 4, PAIR, 1, none) /* Dormand & Prince, order 5(4) */ \
    X(dop853, DOP853, 1, EXPLICIT, 7, PAIR, 0, dop853) /* Dormand & Prince, order 8(5,3) */ \
    X(radau5, RADAU5, 2, IMPLICIT, 3, RADAU, 1, none) /* Radau IIA, order 5 */ \
    X(gauss8, GAUSS8, 3, COLLOCATION, 8, GAUSS, 0, gauss8_lockstep) /* Gauss-Legendre, 8 stages */ \
    X(taylor, TAYLOR, 4, TAYLOR, 6, GAUSS, 0, taylor) /* Taylor series, order by the tolerance */ \
    /* stages of gauss8 one after another, for lanes */ \
    X(gauss8_lockstep, GAUSS8_LOCKSTEP, 5, SWEEPS, 8, GAUSS, 0, gauss8_lockstep)
#define MECHC_METHOD_NUMBER(name, NUMBER, number, ...) MECHC_##NUMBER = number,
typedef enum { MECHC_METHOD_TABLE(MECHC_METHOD_NUMBER) MECHC_METHODS } mechc_method_number;

/* The action at a change point: mechc_options.on_change_point. */
typedef enum { MECHC_CONTINUE_STRAIGHT = 0, MECHC_STOP_BEFORE = 1 } mechc_change_point_policy;

/* The counters of a batch for each member: columns of mechc_batch.counts. */
typedef enum {
    MECHC_COUNT_STEPS = 0,
    MECHC_COUNT_REJECTED = 1,
    MECHC_COUNT_RHS = 2,
    MECHC_COUNT_CLOSURE = 3,
    MECHC_COUNT_CHANGE_POINTS = 4,
    MECHC_COUNTS = 5 /* how many columns there are */
} mechc_count;

/* The least values that each member met: columns of mechc_batch.least. */
typedef enum {
    MECHC_LEAST_SINGULAR = 0,
    MECHC_LEAST_GAP = 1,
    MECHC_LEASTS = 2 /* how many columns there are */
} mechc_least;

/* Reductions of a trajectory to one number: mechc_quantity.reduction. */
typedef enum {
    MECHC_MINIMUM = 0,
    MECHC_MAXIMUM = 1,
    MECHC_MEAN = 2,
    MECHC_FIRST_CROSSING = 3,
    MECHC_LAST = 4
} mechc_reduction;

/* The number that is formed from an output before it is reduced: mechc_quantity.form. */
typedef enum {
    MECHC_COMPONENT = 0,
    MECHC_ABSOLUTE = 1,
    MECHC_NORM = 2,
    MECHC_SUM = 3
} mechc_quantity_form;
