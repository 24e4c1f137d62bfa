/* Outputs that hold accelerations, multipliers or their derivatives: the motion is solved first.  Jacobians
 * of the motion, and of outputs that contain it.  Generic over `real`. */
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_JACOBIANS_VECTOR : !defined MECHC_JACOBIANS_SCALAR
#if R_VECTOR
#define MECHC_JACOBIANS_VECTOR
#else
#define MECHC_JACOBIANS_SCALAR
#endif
#include "dynamics/alone.h"
#include "scene_program.h"
#include "variational/respond.h"

/* Add what further forces change: M du' + J^T dlambda = forces, J du' = 0. */
MECHC_RARE_ONCE void FN(add_forces)(const FN(place) *place, const real *forces, real *accelerations,
                                    real *multipliers)
{
    real residual[MECHC_MOTION_MAX], change[MECHC_MOTION_MAX];
    for (int i = 0; i < MECHC_NU; i++) residual[i] = -forces[i];
    for (int i = MECHC_NU; i < MECHC_MOTION; i++) residual[i] = R(0.0);
    FN(respond_with)(place, residual, 1, multipliers != 0, change);
    for (int i = 0; i < MECHC_NU; i++) accelerations[i] += change[i];
    for (int i = 0; multipliers && i < MECHC_NC; i++) multipliers[i] += change[MECHC_NU + i];
}

/* Solve the motion of a state by itself, one copy for all outputs that need it; multipliers may be NULL. */
MECHC_ONCE void FN(solve)(real t, const real *q, const real *u, const FN(given) *given,
                          FN(place) *place, real *accelerations, real *multipliers)
{
    FN(locate_alone)(t, q, given, place);
    FN(accelerate)(t, q, u, given, place, accelerations, multipliers);
    if (given->forces) FN(add_forces)(place, given->forces, accelerations, multipliers);
}

#if MECHC_NC_MAX > 0
MECHC_INLINE void FN(output_multipliers)(real t, const real *q, const real *u,
                                         const FN(given) *given, real *out)
{
    FN(place) place;
    real accelerations[MECHC_NU_MAX];
    FN(solve)(t, q, u, given, &place, accelerations, out);
}
#endif

#define MECHC_DEFINE_SOLVED(label, name, width)                                                   \
    MECHC_INLINE void FN(output_##label)(real t, const real *q, const real *u,                    \
                                         const FN(given) *given, real *out)                       \
    {                                                                                             \
        FN(place) place;                                                                          \
        real accelerations[MECHC_NU_MAX], multipliers[MECHC_AT_LEAST_ONE(MECHC_NC_MAX)];          \
        FN(solve)(t, q, u, given, &place, accelerations, multipliers);                            \
        FN(solved_##label)(t, q, u, given, accelerations, multipliers, out);                      \
    }
MECHC_SOLVED_OUTPUTS(MECHC_DEFINE_SOLVED)
#undef MECHC_DEFINE_SOLVED

#if MECHC_STATE_JACOBIAN || MECHC_PARAMETER_JACOBIAN || MECHC_GENERAL
MECHC_ONCE void FN(respond)(const FN(place) *place, const real *residual, int columns, real *out)
{
    FN(respond_with)(place, residual, columns, MECHC_OWN > 0, out);
}

/* Jacobian of outputs. partials: of each output by the columns at a given motion, then by the motion. */
MECHC_ONCE void FN(follow)(const real *partials, const real *response, int columns, real *out)
{
    for (int row = 0; row < MECHC_OWN; row++) {
        const real *own = partials + row * (columns + MECHC_MOTION);
        for (int column = 0; column < columns; column++) {
            real sum = own[column];
            for (int i = 0; i < MECHC_MOTION; i++)
                sum += own[columns + i] * response[i * columns + column];
            out[row * columns + column] = sum;
        }
    }
}
#endif

/* Functions for `columns` inputs called `by`: response of the motion; rows of q' and u'; outputs. */
#define MECHC_DEFINE_RESPONSE(by, columns)                                                        \
    MECHC_INLINE void FN(response_##by)(real t, const real *q, const real *u,                     \
                                        const FN(given) *given, real *a, real *l, real *response) \
    {                                                                                             \
        FN(place) place;                                                                          \
        real residual[MECHC_MOTION_MAX * (columns)];                                              \
        FN(solve)(t, q, u, given, &place, a, l);                                                  \
        FN(solved_residual_##by)(t, q, u, given, a, l, residual);                                 \
        FN(respond)(&place, residual, columns, response);                                         \
    }
#if MECHC_OWN_MAX > 0
#define MECHC_DEFINE_OWN(name, by, columns)                                                       \
    MECHC_INLINE void FN(output_own_##name)(real t, const real *q, const real *u,                 \
                                            const FN(given) *given, real *out)                    \
    {                                                                                             \
        real a[MECHC_NU_MAX], l[MECHC_AT_LEAST_ONE(MECHC_NC_MAX)];                                \
        real response[MECHC_MOTION_MAX * (columns)];                                              \
        real own[MECHC_OWN_MAX * (MECHC_MOTION_MAX + (columns))];                                 \
        FN(response_##by)(t, q, u, given, a, l, response);                                        \
        FN(solved_own_##by)(t, q, u, given, a, l, own);                                           \
        FN(follow)(own, response, columns, out);                                                  \
    }
#else
#define MECHC_DEFINE_OWN(name, by, columns)
#endif

/* The rows of q' by columns of which those from `first` on are the speeds: q' = u. */
#if !MECHC_KINEMATICS_CODE
#define MECHC_RATES_BY(by, columns, first)                                                        \
    for (int i = 0; i < MECHC_NQ; i++)                                                            \
        for (int k = 0; k < (columns); k++) out[i * (columns) + k] = R(k == (first) + i)
#else
#define MECHC_RATES_BY(by, columns, first) FN(output_rate_##by)(t, q, u, given, out)
#endif
#define MECHC_DEFINE_JACOBIAN(name, by, columns, first)                                           \
    MECHC_DEFINE_RESPONSE(by, columns)                                                            \
    MECHC_INLINE void FN(output_##name)(real t, const real *q, const real *u,                     \
                                        const FN(given) *given, real *out)                        \
    {                                                                                             \
        real a[MECHC_NU_MAX], l[MECHC_AT_LEAST_ONE(MECHC_NC_MAX)];                                \
        real response[MECHC_MOTION_MAX * (columns)];                                              \
        real *const of_speeds = out + MECHC_NQ * (columns);                                       \
        MECHC_RATES_BY(by, columns, first);                                                       \
        FN(response_##by)(t, q, u, given, a, l, response);                                        \
        for (int i = 0; i < MECHC_NU * (columns); i++) of_speeds[i] = response[i];                \
    }                                                                                             \
    MECHC_DEFINE_OWN(name, by, columns)

#if MECHC_STATE_JACOBIAN
MECHC_DEFINE_JACOBIAN(state_jacobian, by_state, MECHC_NX, MECHC_NQ)
#endif
/* By anything that is no state: no column is a speed. */
#if MECHC_PARAMETER_JACOBIAN
MECHC_DEFINE_JACOBIAN(parameter_jacobian, by_parameters, MECHC_NP, MECHC_NP)
#endif
#if MECHC_INPUT_JACOBIAN /* only where that by the state is asked for */
MECHC_DEFINE_JACOBIAN(input_jacobian, by_inputs, MECHC_NI, MECHC_NI)
#endif
#undef MECHC_RATES_BY
#undef MECHC_DEFINE_JACOBIAN
#undef MECHC_DEFINE_RESPONSE
#undef MECHC_DEFINE_OWN

#endif
