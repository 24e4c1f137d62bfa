# cython: language_level=3
"""The numbers of ``abi/codes.h`` by name: how runs end, methods, policies, reductions."""


cdef extern from "abi/codes.h":
    cpdef enum:
        # How a run, a projection or a member of a batch ended.
        RUNNING "MECHC_RUNNING", FINISHED "MECHC_FINISHED", NOT_CLOSED "MECHC_NOT_CLOSED"
        STEP_TOO_SMALL "MECHC_STEP_TOO_SMALL", NOT_FINITE "MECHC_NOT_FINITE"
        SINGULAR_MASS "MECHC_SINGULAR_MASS", TOO_MANY_STEPS "MECHC_TOO_MANY_STEPS"
        NO_MEMORY "MECHC_NO_MEMORY", UNDECIDED "MECHC_UNDECIDED", NO_STEP_FITS "MECHC_NO_STEP_FITS"
        BRANCH_IN_DOUBT "MECHC_BRANCH_IN_DOUBT", BEND_TOO_SHARP "MECHC_BEND_TOO_SHARP", CHATTERS "MECHC_CHATTERS"
        AT_CHANGE_POINT "MECHC_AT_CHANGE_POINT"
        STOPPED_AT_CHANGE_POINT "MECHC_STOPPED_AT_CHANGE_POINT"
        NOT_RUN "MECHC_NOT_RUN", NEARLY_DEPENDENT "MECHC_NEARLY_DEPENDENT"
        INTERRUPTED "MECHC_INTERRUPTED", STOPPED_BY_EVENT "MECHC_STOPPED_BY_EVENT"
        EVENT_FAILED "MECHC_EVENT_FAILED", OPEN_AT_START "MECHC_OPEN_AT_START"
        NOT_ASSEMBLED "MECHC_NOT_ASSEMBLED", INPUT_FAILED "MECHC_INPUT_FAILED"
        MEMORY_LIMIT "MECHC_MEMORY_LIMIT", DISCONTINUITY "MECHC_DISCONTINUITY"
        RESETS_ACCUMULATE "MECHC_RESETS_ACCUMULATE"
        CONTACT_INCONSISTENT "MECHC_CONTACT_INCONSISTENT"
        CONTACT_UNDECIDED "MECHC_CONTACT_UNDECIDED", CONTACTS_TOO_MANY "MECHC_CONTACTS_TOO_MANY"
        END_OF_REACH "MECHC_END_OF_REACH"
        # How derivatives follow the steps of a method.
        RULE_GAUSS "MECHC_RULE_GAUSS", RULE_RADAU "MECHC_RULE_RADAU", RULE_PAIR "MECHC_RULE_PAIR"
        # Reductions of a trajectory, and the functions of an output in them.
        MINIMUM "MECHC_MINIMUM", MAXIMUM "MECHC_MAXIMUM", MEAN "MECHC_MEAN"
        FIRST_CROSSING "MECHC_FIRST_CROSSING", LAST "MECHC_LAST"
        COMPONENT "MECHC_COMPONENT", ABSOLUTE "MECHC_ABSOLUTE", NORM "MECHC_NORM"

    int MECHC_CONTINUE_STRAIGHT, MECHC_STOP_BEFORE
    int MECHC_COUNT_STEPS, MECHC_COUNT_REJECTED, MECHC_COUNT_RHS, MECHC_COUNT_CLOSURE
    int MECHC_COUNT_CHANGE_POINTS
    int MECHC_LEAST_SINGULAR, MECHC_LEAST_GAP

cdef extern from *:
    """
    typedef struct { const char *name, *lockstep; int number, degree, rule; } mechc_method_row;
    #define MECHC_METHOD_ROW(name, NUMBER, number, PART, degree, RULE, kept, lockstep) \
        {#name, #lockstep, number, degree, MECHC_RULE_##RULE},
    static const mechc_method_row mechc_method_rows[] = {MECHC_METHOD_TABLE(MECHC_METHOD_ROW)};
    enum { mechc_method_count = MECHC_METHODS };
    """
    ctypedef struct mechc_method_row:
        const char *name
        const char *lockstep
        int number, degree, rule

    const mechc_method_row mechc_method_rows[]
    int mechc_method_count


cdef list rows = [mechc_method_rows[i] for i in range(mechc_method_count)]
METHODS = {row["name"].decode(): row["number"] for row in rows}
DEGREES = {row["name"].decode(): row["degree"] for row in rows}
# The method whose code takes several runs of a method in the lanes, where there is one.
LOCKSTEP = {
    row["name"].decode(): row["lockstep"].decode() for row in rows if row["lockstep"] != b"none"
}
RULES = {row["name"].decode(): row["rule"] for row in rows}

# What a run does at a change point; for an error it stops, and Python raises it.
CHANGE_POINT_POLICIES = {
    "continue": MECHC_CONTINUE_STRAIGHT, "stop": MECHC_STOP_BEFORE, "raise": MECHC_STOP_BEFORE,
}

# Columns of the counters of a batch, and of its least values.
COUNTERS = {
    "steps": MECHC_COUNT_STEPS,
    "rejected": MECHC_COUNT_REJECTED,
    "rhs_evaluations": MECHC_COUNT_RHS,
    "closure_iterations": MECHC_COUNT_CLOSURE,
    "change_points": MECHC_COUNT_CHANGE_POINTS,
}
LEAST = {"least_singular": MECHC_LEAST_SINGULAR, "critical_gap": MECHC_LEAST_GAP}
