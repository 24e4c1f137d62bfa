/* Reading the inputs of a run, over `real`: each lane at its own time and state. */
#include <string.h>
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_READ_INPUTS_VECTOR : !defined MECHC_READ_INPUTS_SCALAR
#if R_VECTOR
#define MECHC_READ_INPUTS_VECTOR
#else
#define MECHC_READ_INPUTS_SCALAR
#endif
#include "abi/inputs.h"
#include "dynamics/sizes.h"
#include "simd/lanes.h"

#if MECHC_NI > 0
/* Values first .. last - 1; u may be NULL where no input needs the speeds. */
MECHC_ONCE void FN(read_inputs)(real t, const real *q, const real *u, const real *p, int first,
                                int last, real *values)
{
    double times[RLANES], passed[RLANES], found[MECHC_NI][RLANES];
    memcpy(times, &t, sizeof times);
    memcpy(passed, p + MECHC_NP, sizeof passed);
    for (int lane = 0; lane < RLANES; lane++) {
        const mechc_inputs *inputs = mechc_inputs_found(passed[lane]);
        double own_q[MECHC_NQ], own_u[MECHC_NU], own[MECHC_NI];
        for (int i = 0; inputs->needs_state && i < MECHC_NQ; i++)
            memcpy(own_q + i, (const double *)(q + i) + lane, sizeof(double));
        for (int i = 0; inputs->needs_state && u && i < MECHC_NU; i++)
            memcpy(own_u + i, (const double *)(u + i) + lane, sizeof(double));
        inputs->evaluate(inputs, first, last, times[lane], own_q, u ? own_u : 0, own);
        for (int i = first; i < last; i++) found[i - first][lane] = own[i - first];
    }
    for (int i = 0; i < last - first; i++) memcpy(values + i, found[i], sizeof found[i]);
}
#endif
#endif
