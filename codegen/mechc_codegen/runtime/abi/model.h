/* The binary interface between a compiled scene and its callers. */
#pragma once

#include <stddef.h>
#include "inputs.h"
#include "parts.h"
#include "run.h"
#include "variation.h"

#define MECHC_ABI 23
#define MECHC_CAPSULE "mechc.model.11"

/* Arrays of states are walked with a stride in doubles; stride 0 repeats one row. */
typedef struct {
    const double *data;
    ptrdiff_t stride;
} mechc_rows;

/* out[k*width ...] = output at (t[k], y[k], p[k]), k < count; out is contiguous.  `inputs` may be
 * NULL for outputs that hold none.  forces: generalized forces (nu) besides those of the scene, of
 * contacts, with which outputs that hold accelerations or multipliers are solved; NULL: none. */
typedef void mechc_evaluate(ptrdiff_t count, mechc_rows t, mechc_rows y, mechc_rows p,
                            const mechc_inputs *inputs, mechc_rows forces, double *out);

#define MECHC_NO_FORCES ((mechc_rows){0, 0})

/* Parameters, inputs and constants of one scene: given_size bytes that start at a multiple of 8. */
typedef struct mechc_given mechc_given;

typedef struct {
    const char *name;
    int width;
    mechc_evaluate *evaluate;
} mechc_output;

/* One compilation of a scene for one instruction set; a part of it has only its own functions, the
 * others are NULL. */
typedef struct {
    const char *instruction_set;
    int lanes;
    int identity_kinematics; /* whether q' = u */
    int output_count;
    const mechc_output *outputs;
    size_t given_size;
    void (*give)(const double *p, const mechc_inputs *inputs, mechc_given *given);
    /* Unprojected state rates of one state, with what give() has prepared. */
    void (*rates)(double t, const double *y, const mechc_given *given, double *out);
    /* M (nu x nu), row by row; NULL where it is no output. */
    void (*mass)(double t, const double *y, const mechc_given *given, double *out);
    /* Nearest state on the constraints; moved[0], moved[1]: largest closure gap and largest
       velocity residual found before. */
    int (*project)(double t, double *y, const double *p, const mechc_inputs *inputs, double *moved);
    size_t run_size;
    /* Methods by their numbers; a method without code in this part has its traits alone, or is NULL. */
    const mechc_method *const *methods;
    void (*start)(mechc_run *run, const mechc_options *options);
    /* At most `steps` attempted steps; returns run->status. */
    int (*advance)(mechc_run *run, long steps);
    /* Likewise for up to `lanes` runs side by side, where method and scene allow it; each has the
       same results as alone.  Returns early when one of them ends. */
    void (*advance_lockstep)(mechc_run **runs, int count, long steps);
    void (*release)(mechc_run *run);
    /* Dense output, projected onto the constraints where that is asked for. */
    void (*interpolate)(int project, const mechc_trajectory *trajectory, const double *p,
                        const mechc_inputs *inputs, ptrdiff_t count, const double *t, double *out);
    /* Go on to t1, beyond the end of the run or before it, with other inputs; NULL: the same. */
    void (*extend)(mechc_run *run, double t1, const mechc_inputs *inputs);
    /* A run between two steps as so many bytes, and the same run brought back to them; its
     * trajectory then begins there. */
    size_t (*saved_size)(const mechc_run *run);
    void (*save)(const mechc_run *run, void *saved);
    void (*restore)(mechc_run *run, const void *saved);
    /* Derivatives over steps of a finished run; MECHC_RUNNING, or why there are none.  NULL where
     * the scene was compiled without them. */
    int (*vary)(const mechc_variation *variation);
    int (*covary)(const mechc_covariation *covariation);
    int (*project_columns)(const mechc_projected_columns *columns);
} mechc_unit;

/* A part of a unit in a shared object of its own. */
typedef struct {
    int abi, parts;
    const mechc_unit *unit;
} mechc_part;

typedef struct {
    int abi;
    const char *metadata; /* JSON */
    int coordinates, speeds, holonomic, rows, parameters;
    /* Parameters not given take their defaults, which may follow those given. */
    void (*complete)(const unsigned char *given, double *p);
    const mechc_unit *(*select)(const char *instruction_set); /* NULL: the widest that runs here */
    int inputs; /* values that a run is given: see inputs.h */
    const char *texts; /* that the parts of its unit are compiled from, JSON; or NULL */
    /* Parts by which runs begin: driver and methods that are compiled for all scenes of a kind, or NULL;
     * with it the scene's series, and derivatives of runs, or NULL. */
    const mechc_part *general, *series, *derivatives;
    int bound; /* components of a state that their arrays hold */
} mechc_model;

/* Of a unit that runs tapes: the model of a tape, whose bytes are kept; NULL: `why` tells what is wrong. */
typedef struct {
    int abi;
    const char *key; /* by which an installed unit is found */
    const mechc_model *(*open)(const unsigned char *bytes, size_t size, const char **why);
} mechc_tape_opener;
