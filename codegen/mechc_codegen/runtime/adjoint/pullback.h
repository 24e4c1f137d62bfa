/* Covectors of the rates, pulled back to what the rates are computed from: state, parameters and
 * inputs; generic over `real`.
 *
 * With K the matrix of M du' + J^T dlambda = -dR, J du' = -dS, a covector z on accelerations gives
 * z^T du' = -w^T (dR, dS) with K w = (z, 0), and the program differentiates the one number
 * w . (R, S) in reverse.  No Jacobian is formed: the work does not grow with their columns.
 */
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_PULLBACK_VECTOR : !defined MECHC_PULLBACK_SCALAR
#if R_VECTOR
#define MECHC_PULLBACK_VECTOR
#else
#define MECHC_PULLBACK_SCALAR
#endif
#include "variational/linearise.h"

#if MECHC_VARIATIONAL
#define MECHC_COVECTOR_MAX (MECHC_MOTION_MAX + (MECHC_KINEMATICS_CODE ? MECHC_NQ_MAX : 0))

/* A state whose motion is solved, with the data that pulling covectors back there needs. */
typedef struct {
    real t, y[MECHC_NX_MAX];
    FN(place) place;
    real a[MECHC_NU_MAX], l[MECHC_AT_LEAST_ONE(MECHC_NC_MAX)];
    rmask along; /* the rates are those of the projected state */
#if MECHC_NC_MAX > 0
    real responses[MECHC_NU_MAX * MECHC_MOTION_MAX]; /* the rows of K^-1 for accelerations */
    real tangent[MECHC_NX_MAX * MECHC_SLOPES_MAX];
#elif MECHC_WALKED
    FN(mass_factors) factors;
#endif
} FN(solved_state);

/* Rates at a state. */
MECHC_ONCE void FN(solve_state)(real t, const real *y, const FN(given) *given,
                                FN(solved_state) *at, real *rates)
{
    at->t = t;
    for (int k = 0; k < MECHC_NX; k++) at->y[k] = y[k];
    FN(locate)(t, y, given, &at->place);
    FN(accelerate)(t, y, y + MECHC_NQ, given, &at->place, at->a, at->l);
    FN(coordinate_rates_of)(t, y, y + MECHC_NQ, given, rates);
    for (int k = 0; k < MECHC_NU; k++) rates[MECHC_NQ + k] = at->a[k];
}

/* Compute the factors of K, and the projection if the rates are along the constraints. */
MECHC_ONCE void FN(prepare_pullback)(const FN(given) *given, rmask along, FN(solved_state) *at)
{
    at->along = along;
#if MECHC_NC_MAX > 0
    real unit[MECHC_MOTION_MAX * MECHC_MOTION_MAX];
    for (int i = 0; i < MECHC_MOTION * MECHC_MOTION; i++)
        unit[i] = R(i % (MECHC_MOTION + 1) == 0 ? -1.0 : 0.0);
    FN(respond_with)(&at->place, unit, MECHC_MOTION, 0, at->responses);
    if (R_ANY(along)) FN(put_tangent)(at->t, at->y, given, &at->place, at->tangent);
#elif MECHC_WALKED
    real mass[MECHC_NU_MAX * MECHC_NU_MAX];
    FN(composite_mass)(at->place.saved, mass);
    FN(factor_mass)(mass, MECHC_NU, &at->factors);
#endif
    (void)given;
}

/* w <- -K^-1 (z, 0) */
MECHC_INLINE void FN(weigh_residual)(const FN(solved_state) *at, const real *z, real *w)
{
#if MECHC_NC_MAX > 0
    for (int m = 0; m < MECHC_MOTION; m++) w[m] = R(0.0);
    for (int i = 0; i < MECHC_NU; i++)
        for (int m = 0; m < MECHC_MOTION; m++) R_SUB(w[m], at->responses[i * MECHC_MOTION + m], z[i]);
#else
#if MECHC_WALKED
    const FN(mass_factors) *factors = &at->factors;
#else
    const FN(mass_factors) *factors = &at->place.factored;
#endif
    for (int i = 0; i < MECHC_NU; i++) w[i] = -z[i];
    FN(forward)(factors, MECHC_NU, w);
    FN(backward)(factors, MECHC_NU, w);
#endif
}

#if MECHC_NC_MAX > 0
/* Pull MECHC_SLOPES slopes back through the projection, in place. */
MECHC_INLINE void FN(pull_through)(const real *tangent, rmask along, real *slopes)
{
    real after[MECHC_NX_MAX];
    for (int i = 0; i < MECHC_NX; i++) {
        after[i] = slopes[i];
        slopes[i] = R_SELECT(along, R(0.0), slopes[i]);
    }
    for (int i = 0; i < MECHC_NX; i++) {
        const real weight = R_SELECT(along, after[i], R(0.0));
        for (int k = 0; k < MECHC_SLOPES; k++) R_ADD(slopes[k], weight, tangent[i * MECHC_SLOPES + k]);
    }
}
#endif

/* Pull z, a covector of the rates, back; slopes: derivatives of z . rates by state, parameters and inputs. */
MECHC_ONCE void FN(pull_back)(const FN(solved_state) *at, const FN(given) *given, const real *z,
                              real *slopes)
{
    const real *const u = at->y + MECHC_NQ;
    real weights[MECHC_COVECTOR_MAX];
    FN(weigh_residual)(at, z + MECHC_NQ, weights);
#if MECHC_KINEMATICS_CODE
    for (int k = 0; !MECHC_IDENTITY_KINEMATICS && k < MECHC_NQ; k++) weights[MECHC_MOTION + k] = z[k];
#endif
    FN(solved_residual_adjoint)(at->t, at->y, u, given, at->a, at->l, weights, slopes);
    for (int k = 0; MECHC_IDENTITY_KINEMATICS && k < MECHC_NQ; k++) slopes[MECHC_NQ + k] += z[k];
#if MECHC_NC_MAX > 0
    if (R_ANY(at->along)) FN(pull_through)(at->tangent, at->along, slopes);
#endif
}
#endif
#endif
