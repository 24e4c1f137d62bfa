/* Outputs that hold accelerations, multipliers or their derivatives: the motion is solved first.
 * Generic over `real`. */

/* One copy for all that need it; multipliers may be NULL. */
MECHC_ONCE void FN(solve)(real t, const real *q, const real *u, const real *p, const real *k,
                          FN(place) *place, real *accelerations, real *multipliers)
{
    FN(locate)(t, q, p, k, place);
    FN(accelerate)(t, q, u, p, k, place, accelerations, multipliers);
}

#if MECHC_NC > 0
MECHC_INLINE void FN(output_multipliers)(real t, const real *q, const real *u, const real *p,
                                         const real *k, real *out)
{
    FN(place) place;
    real accelerations[MECHC_NU];
    FN(solve)(t, q, u, p, k, &place, accelerations, out);
}
#endif

#define MECHC_DEFINE_SOLVED(label, width)                                                         \
    MECHC_INLINE void FN(output_##label)(real t, const real *q, const real *u, const real *p,     \
                                         const real *k, real *out)                                \
    {                                                                                             \
        FN(place) place;                                                                          \
        real accelerations[MECHC_NU], multipliers[MECHC_AT_LEAST_ONE(MECHC_NC)];                  \
        FN(solve)(t, q, u, p, k, &place, accelerations, multipliers);                             \
        FN(solved_##label)(t, q, u, p, k, accelerations, multipliers, out);                       \
    }
MECHC_SOLVED_OUTPUTS(MECHC_DEFINE_SOLVED)
#undef MECHC_DEFINE_SOLVED

#if MECHC_STATE_JACOBIAN || MECHC_PARAMETER_JACOBIAN
/* du' of M du' + J^T dlambda = -dR and J du' = -dS, column by column of dR and dS. */
MECHC_ONCE void FN(respond)(const FN(place) *place, const real *residual, int columns, real *out)
{
    for (int column = 0; column < columns; column++) {
        real x[MECHC_NU];
#if MECHC_NC > 0
        real forcing[MECHC_NU], gamma[MECHC_NC];
        const FN(motion_terms) terms = {place->mass, place->jacobian, forcing, gamma};
        for (int i = 0; i < MECHC_NU; i++) forcing[i] = -residual[i * columns + column];
        for (int i = 0; i < MECHC_NC; i++) gamma[i] = -residual[(MECHC_NU + i) * columns + column];
        FN(solve_motion)(&terms, &place->rows, x, 0);
#else
        for (int i = 0; i < MECHC_NU; i++) x[i] = -residual[i * columns + column];
        FN(forward)(&place->factored, MECHC_NU, x);
        FN(backward)(&place->factored, MECHC_NU, x);
#endif
        for (int i = 0; i < MECHC_NU; i++) out[i * columns + column] = x[i];
    }
}
#endif

#if MECHC_STATE_JACOBIAN
MECHC_INLINE void FN(output_state_jacobian)(real t, const real *q, const real *u, const real *p,
                                            const real *k, real *out)
{
    FN(place) place;
    real accelerations[MECHC_NU], multipliers[MECHC_AT_LEAST_ONE(MECHC_NC)];
    real residual[(MECHC_NU + MECHC_NC) * (MECHC_NQ + MECHC_NU)];
    FN(solve)(t, q, u, p, k, &place, accelerations, multipliers);
    FN(solved_residual_by_state)(t, q, u, p, k, accelerations, multipliers, residual);
#if MECHC_IDENTITY_KINEMATICS
    for (int i = 0; i < MECHC_NQ * (MECHC_NQ + MECHC_NU); i++)
        out[i] = R(i % (MECHC_NQ + MECHC_NU) == MECHC_NQ + i / (MECHC_NQ + MECHC_NU));
#else
    FN(output_rate_by_state)(t, q, u, p, k, out);
#endif
    FN(respond)(&place, residual, MECHC_NQ + MECHC_NU, out + MECHC_NQ * (MECHC_NQ + MECHC_NU));
}
#endif

#if MECHC_PARAMETER_JACOBIAN
MECHC_INLINE void FN(output_parameter_jacobian)(real t, const real *q, const real *u,
                                                const real *p, const real *k, real *out)
{
    FN(place) place;
    real accelerations[MECHC_NU], multipliers[MECHC_AT_LEAST_ONE(MECHC_NC)];
    real residual[(MECHC_NU + MECHC_NC) * MECHC_NP];
    FN(solve)(t, q, u, p, k, &place, accelerations, multipliers);
    FN(solved_residual_by_parameters)(t, q, u, p, k, accelerations, multipliers, residual);
#if MECHC_IDENTITY_KINEMATICS
    for (int i = 0; i < MECHC_NQ * MECHC_NP; i++) out[i] = R(0.0);
#else
    FN(output_rate_by_parameters)(t, q, u, p, k, out);
#endif
    FN(respond)(&place, residual, MECHC_NP, out + MECHC_NQ * MECHC_NP);
}
#endif
