/* Outputs that hold accelerations, multipliers or their derivatives: the motion is solved first.
 * Generic over `real`. */
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_SOLVED_VECTOR : !defined MECHC_SOLVED_SCALAR
#if R_VECTOR
#define MECHC_SOLVED_VECTOR
#else
#define MECHC_SOLVED_SCALAR
#endif
#include "dynamics/stage.h"
#include "scene_program.h"

/* Solve the motion, one copy for all outputs that need it; multipliers may be NULL. */
MECHC_ONCE void FN(solve)(real t, const real *q, const real *u, const FN(given) *given,
                          FN(place) *place, real *accelerations, real *multipliers)
{
    FN(locate)(t, q, given, place);
    FN(accelerate)(t, q, u, given, place, accelerations, multipliers);
}

#if MECHC_NC > 0
MECHC_INLINE void FN(output_multipliers)(real t, const real *q, const real *u,
                                         const FN(given) *given, real *out)
{
    FN(place) place;
    real accelerations[MECHC_NU];
    FN(solve)(t, q, u, given, &place, accelerations, out);
}
#endif

#define MECHC_DEFINE_SOLVED(label, name, width)                                                   \
    MECHC_INLINE void FN(output_##label)(real t, const real *q, const real *u,                    \
                                         const FN(given) *given, real *out)                       \
    {                                                                                             \
        FN(place) place;                                                                          \
        real accelerations[MECHC_NU], multipliers[MECHC_AT_LEAST_ONE(MECHC_NC)];                  \
        FN(solve)(t, q, u, given, &place, accelerations, multipliers);                            \
        FN(solved_##label)(t, q, u, given, accelerations, multipliers, out);                      \
    }
MECHC_SOLVED_OUTPUTS(MECHC_DEFINE_SOLVED)
#undef MECHC_DEFINE_SOLVED

#endif
