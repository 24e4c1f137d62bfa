/* The response of accelerations and multipliers to changes of the equations of motion; generic over
 * `real`. */
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_RESPOND_VECTOR : !defined MECHC_RESPOND_SCALAR
#if R_VECTOR
#define MECHC_RESPOND_VECTOR
#else
#define MECHC_RESPOND_SCALAR
#endif
#include "dynamics/linear.h"
#include "dynamics/loops/motion.h"
#include "dynamics/motion.h"
#include "dynamics/stage.h"
#include "dynamics/tree.h"

#define MECHC_MOTION (MECHC_NU + MECHC_NC) /* accelerations and multipliers */
#define MECHC_MOTION_MAX (MECHC_NU_MAX + MECHC_NC_MAX)

/* du' and dlambda of M du' + J^T dlambda = -dR and J du' = -dS, column by column of dR and
 * dS; without multipliers the rows of du' alone. */
MECHC_INLINE void FN(respond_with)(const FN(place) *place, const real *residual, int columns,
                                   int multipliers, real *out)
{
#if MECHC_WALKED /* all at once: a Jacobian is full, however sparse the tree */
    real mass[MECHC_NU_MAX * MECHC_NU_MAX];
#if MECHC_NC_MAX > 0
    FN(factors) factors;
    real jacobian[MECHC_NC_MAX * MECHC_NU_MAX];
    FN(factor_together)(place->saved, jacobian, mass, place->rank, &factors);
#else
    FN(mass_factors) factors;
    FN(composite_mass)(place->saved, mass);
    FN(factor_mass)(mass, MECHC_NU, &factors);
#endif
#elif MECHC_NC_MAX == 0
    const FN(mass_factors) factors = place->factored;
#endif
    for (int column = 0; column < columns; column++) {
        real right[MECHC_MOTION_MAX], x[MECHC_MOTION_MAX];
        for (int i = 0; i < MECHC_MOTION; i++) right[i] = -residual[i * columns + column];
#if MECHC_NC_MAX > 0 && MECHC_WALKED
        FN(solve_together)(&factors, jacobian, right, right + MECHC_NU, x, x + MECHC_NU);
#elif MECHC_NC_MAX > 0
        const FN(motion_terms) terms = {place->mass, place->jacobian, right, right + MECHC_NU,
                                        place->rank, place->length};
        FN(solve_motion)(&terms, &place->rows, x, multipliers ? x + MECHC_NU : 0);
        for (int i = MECHC_NU; !multipliers && i < MECHC_MOTION; i++) x[i] = R(0.0);
#else
        for (int i = 0; i < MECHC_NU; i++) x[i] = right[i];
        FN(forward)(&factors, MECHC_NU, x);
        FN(backward)(&factors, MECHC_NU, x);
#endif
        for (int i = 0; i < (multipliers ? MECHC_MOTION : MECHC_NU); i++)
            out[i * columns + column] = x[i];
    }
}

#endif
