/* A method is a table: all that the driver asks of it.
 *
 * The driver (stepping/) reaches methods through this table alone.  A step begins at run->y, whose
 * rates are the first of run->rates, and leaves the rates of its end at `last_rate`.  A question
 * that a method has no answer to is NULL.
 */
#pragma once

#include <stdint.h>
#include <stdlib.h>
#include "run/integration.h"
#include "run/memory.h"

/* The scenes of which runs of a method may continue side by side: those without narrow features and
 * tables, and those without any switching functions. */
enum { MECHC_WITHOUT_FEATURES = 1, MECHC_WITHOUT_SWITCHES };

struct mechc_method {
    mechc_method_number number;
    int order;      /* exponent of the step-size law */
    int last_rate;  /* the rates of a step's end are kept there */
    int dense_rows; /* of its dense output */
    int (*rows_of)(const mechc_integration *run); /* the same where it depends on the run, or NULL */
    mechc_nodes nodes; /* where in a step its rates are taken */
    const mechc_tableau *tableau; /* NULL: the method keeps its own */

    /* Step control. */
    double share;         /* of the tolerance that one step may use: local errors accumulate over a
                             run, and what was asked for is judged at its end */
    double growth;        /* most that one step may be longer than the one before */
    double farthest;      /* the same where a step was shortened to place a crossing */
    double ignored;       /* a step that could grow by less keeps its length */
    double after_failure; /* of the step, where a stage could not be taken */
    int root_error;       /* error() gives the root of what the others give */

    /* Critical configurations. */
    /* The configuration at a node of the step, between its ends; NULL: they are not kept. */
    void (*node)(const mechc_integration *run, int node, double *q);
    /* Values of the switching functions from the step's start to its end at the nodes of collocation,
     * node after node of each; NULL: its steps are cut at the edges of features alone. */
    void (*switching)(mechc_integration *run, double h, double *values);
    int holds_crossing; /* a step may hold a crossing in a wide gap between its nodes */
    double horizon;     /* steps ahead that crossings are looked for */

    int in_lockstep; /* runs of several states may continue side by side: of which scenes */
    int by_itself;   /* a run by itself is left to the driver, which gives it the same numbers */
    mechc_method_number alone; /* by which others continue; 0: by this one */
    /* Does a run that continues alone by this method still need what it does alone?  NULL: it does not. */
    int (*stays_alone)(const mechc_integration *run);
    /* Up to `steps` attempts of each of up to MECHC_LANES such runs, a lane each: see lockstep/.
     * Returns those made, early where a run has ended or continues alone. */
    long (*together)(mechc_integration **runs, int count, long steps);

    size_t work_size;                                            /* 0: none */
    void (*make)(mechc_integration *run);                        /* the work space, from any content */
    void (*enter)(mechc_integration *run);                       /* continue from any state */
    void (*renew)(mechc_integration *run);                       /* with other inputs */
    int (*step)(mechc_integration *run, double h, double *end);  /* MECHC_RUNNING or why not */
    double (*error)(mechc_integration *run, double h, const double *end); /* over the tolerance */
    /* The error by what the rates do before the first stage and beyond the last one, where the start
     * and the end can be judged; NULL: they are stages. */
    double (*ends_error)(const mechc_integration *run, double h, int start, int end);
    double (*factor)(mechc_integration *run, double error);      /* factor of the next step */
    /* Was a step that its error refuses followed to an end that tells where it led? */
    int (*shows_end)(const mechc_integration *run, double error);
    void (*accept)(mechc_integration *run, double h);
    /* Did stability, not accuracy, limit an accepted step?  NULL: it never does. */
    int (*limited)(const mechc_integration *run, double h, const double *end, double error);
    /* Set the length of the next step, which the method knows before it tries it; NULL: step control
     * does. */
    void (*plan)(mechc_integration *run);
    /* How long a step may be begun, at most; NULL: any, and crossings are not looked for before a
     * step is tried. */
    double (*reach)(const mechc_integration *run);
    int (*dense_stages)(mechc_integration *run, double h);       /* stages of the dense output */
    /* The first `count` rows of the dense output: see dense_output.h. */
    void (*dense)(mechc_integration *run, double h, const double *end, int count, double *rows);
};

/* The part of its tolerance that a step after so many may use, of a method whose errors have one sign over
 * long runs: Taylor series, and the iteration of collocation, which is symmetric but for what that leaves. */
MECHC_STATIC double mechc_part_of_share(int64_t steps)
{
    return steps > MECHC_STEPS_OF_SHARE ? MECHC_STEPS_OF_SHARE / (double)steps : 1.0;
}

/* Allocate the work space of a method without initialisation; NULL without memory. */
MECHC_STATIC void *mechc_new_work(const mechc_method *method)
{
    return mechc_new_aligned(method->work_size);
}

/* Whether the code of a method is loaded, not only its traits. */
MECHC_STATIC int mechc_is_loaded(const mechc_method *method)
{
    return method->step || method->together;
}

/* Continue with a method; 0 without memory. */
MECHC_STATIC int mechc_use_method(mechc_integration *run, const mechc_method *method)
{
    void **work = &run->work[method->number];
    const mechc_method *over_crossings = method->reach ? method : run->methods[MECHC_DOP853];
    run->current = run->method = method;
    memset(run->next_compensation, 0, sizeof run->next_compensation);
    mechc_widest_gap(over_crossings->nodes, &run->low, &run->best, &run->high);
    run->horizon = method->horizon;
    if (!mechc_is_loaded(method)) return 1;
    if (method->work_size && !*work) {
        if (!(*work = mechc_new_work(method))) return 0;
        method->make(run);
    }
    if (method->enter) method->enter(run);
    return 1;
}

/* Use the code of this step's method if it has been loaded since; 0 if it is still missing or
 * without memory. */
MECHC_STATIC int mechc_use_loaded(mechc_integration *run)
{
    const int in_use = run->current == run->method;
    const mechc_method *method = run->methods[run->current->number];
    const int loaded = mechc_is_loaded(method);
    run->head.wanted = loaded ? -1 : (int)method->number;
    if (!loaded) return 0;
    run->current = method;
    if (!in_use || mechc_use_method(run, method)) return 1;
    run->head.status = MECHC_NO_MEMORY;
    return 0;
}

MECHC_STATIC void mechc_free_work(mechc_integration *run)
{
    for (int i = 0; i < MECHC_METHODS; i++) {
        mechc_free_aligned(run->work[i]);
        run->work[i] = 0;
    }
}
