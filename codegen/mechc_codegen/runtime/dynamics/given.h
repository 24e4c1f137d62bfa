/* The arguments of a run and values that follow from them: parameters, constants, inputs.
 *
 * Generic over `real`: each lane has parameters, inputs, time and state of its own. */
#include <math.h>
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_GIVEN_VECTOR : !defined MECHC_GIVEN_SCALAR
#if R_VECTOR
#define MECHC_GIVEN_VECTOR
#else
#define MECHC_GIVEN_SCALAR
#endif
#include "abi/codes.h"
#include "abi/inputs.h"
#include "dynamics/sizes.h"

#ifndef MECHC_ROW_COUNT
#define MECHC_ROW_COUNT
typedef int mechc_row_count(double t, const double *q, const double *p, const mechc_inputs *inputs);
#endif

typedef struct {
    real p[MECHC_AT_LEAST_ONE(MECHC_NP_MAX)]; /* parameters */
    real k[MECHC_CONSTANTS_MAX];              /* constants made of them */
    const mechc_inputs *inputs[RLANES];   /* of a scene that has any */
    const int *stop;                      /* see mechc_options */
    const real *forces; /* generalized (nu), besides the scene's own: outputs that hold accelerations
                           are solved with them, stages of methods are not; NULL: none */
    mechc_row_count *count; /* tells how many rows count at a state by itself; NULL: the constants do */
} FN(given);

/* Whether another thread asks to stop the present work, which takes long in a wide scene: it then
 * fails with MECHC_INTERRUPTED, or its result is not used. */
MECHC_INLINE int FN(stopped)(const FN(given) *given)
{
    return MECHC_NX >= MECHC_WIDE && given->stop && __atomic_load_n(given->stop, __ATOMIC_RELAXED);
}

/* The numbers of one lane. */
MECHC_INLINE void FN(take_lane)(const real *values, int count, int lane, double *out)
{
    for (int i = 0; i < count; i++) memcpy(out + i, (const double *)(values + i) + lane, sizeof *out);
}

#if MECHC_NI_MAX > 0
/* Input values first .. last - 1, NaN if no inputs are given; u may be NULL if none needs the
 * speeds.  A lane that repeats the one before it, as all but one do if a single run is in lockstep,
 * has its values: a function may be costly. */
MECHC_ONCE void FN(read_inputs)(real t, const real *q, const real *u, const FN(given) *given,
                                int first, int last, real *values)
{
    double times[RLANES], found[MECHC_NI_MAX][RLANES];
    double state[2][MECHC_NQ_MAX + MECHC_NU_MAX] = {{0.0}};
    memcpy(times, &t, sizeof times);
    for (int lane = 0; lane < RLANES; lane++) {
        const mechc_inputs *inputs = given->inputs[lane];
        double *own = state[lane & 1], value[MECHC_NI_MAX];
        const int needs_state = inputs && inputs->needs_state;
        if (needs_state) FN(take_lane)(q, MECHC_NQ, lane, own);
        if (needs_state && u) FN(take_lane)(u, MECHC_NU, lane, own + MECHC_NQ);
        const int repeated = lane && inputs == given->inputs[lane - 1]
                          && times[lane] == times[lane - 1]
                          && memcmp(state[0], state[1], sizeof state[0]) == 0;
        if (inputs && !repeated)
            inputs->evaluate(inputs, first, last, times[lane], own, u ? own + MECHC_NQ : 0, value);
        for (int i = 0; i < last - first; i++)
            found[i][lane] = repeated ? found[i][lane - 1] : inputs ? value[i] : NAN;
    }
    for (int i = 0; i < last - first; i++) memcpy(values + i, found[i], sizeof found[i]);
}
#endif
#endif
