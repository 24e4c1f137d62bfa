/* Jacobians of the motion, and of outputs that contain it; generic over `real`. */
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_JACOBIANS_VECTOR : !defined MECHC_JACOBIANS_SCALAR
#if R_VECTOR
#define MECHC_JACOBIANS_VECTOR
#else
#define MECHC_JACOBIANS_SCALAR
#endif
#include "dynamics/stage.h"
#include "scene_program.h"
#include "unit/solved.h"
#include "variational/respond.h"

#if MECHC_STATE_JACOBIAN || MECHC_PARAMETER_JACOBIAN
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
        real residual[MECHC_MOTION * (columns)];                                                  \
        FN(solve)(t, q, u, given, &place, a, l);                                                  \
        FN(solved_residual_##by)(t, q, u, given, a, l, residual);                                 \
        FN(respond)(&place, residual, columns, response);                                         \
    }
#define MECHC_DEFINE_OWN(name, by, columns)                                                       \
    MECHC_INLINE void FN(output_own_##name)(real t, const real *q, const real *u,                 \
                                            const FN(given) *given, real *out)                    \
    {                                                                                             \
        real a[MECHC_NU], l[MECHC_AT_LEAST_ONE(MECHC_NC)];                                        \
        real response[MECHC_MOTION * (columns)], own[MECHC_OWN * (MECHC_MOTION + (columns))];     \
        FN(response_##by)(t, q, u, given, a, l, response);                                        \
        FN(solved_own_##by)(t, q, u, given, a, l, own);                                           \
        FN(follow)(own, response, columns, out);                                                  \
    }

#if MECHC_STATE_JACOBIAN
MECHC_DEFINE_RESPONSE(by_state, MECHC_NQ + MECHC_NU)

MECHC_INLINE void FN(output_state_jacobian)(real t, const real *q, const real *u,
                                            const FN(given) *given, real *out)
{
    const int columns = MECHC_NQ + MECHC_NU;
    real a[MECHC_NU], l[MECHC_AT_LEAST_ONE(MECHC_NC)];
    real response[MECHC_MOTION * (MECHC_NQ + MECHC_NU)];
#if MECHC_IDENTITY_KINEMATICS
    for (int i = 0; i < MECHC_NQ * columns; i++)
        out[i] = R(i % columns == MECHC_NQ + i / columns);
#else
    FN(output_rate_by_state)(t, q, u, given, out);
#endif
    FN(response_by_state)(t, q, u, given, a, l, response);
    for (int i = 0; i < MECHC_NU * columns; i++) out[MECHC_NQ * columns + i] = response[i];
}
#if MECHC_OWN > 0
MECHC_DEFINE_OWN(state_jacobian, by_state, MECHC_NQ + MECHC_NU)
#endif
#endif

/* By anything that is no state: the rows of q' = u vanish. */
#if MECHC_IDENTITY_KINEMATICS
#define MECHC_RATES_BY(by, columns) \
    for (int i = 0; i < MECHC_NQ * (columns); i++) out[i] = R(0.0)
#else
#define MECHC_RATES_BY(by, columns) FN(output_rate_##by)(t, q, u, given, out)
#endif
#define MECHC_DEFINE_JACOBIAN(name, by, columns)                                                  \
    MECHC_DEFINE_RESPONSE(by, columns)                                                            \
    MECHC_INLINE void FN(output_##name)(real t, const real *q, const real *u,                     \
                                        const FN(given) *given, real *out)                        \
    {                                                                                             \
        real a[MECHC_NU], l[MECHC_AT_LEAST_ONE(MECHC_NC)], response[MECHC_MOTION * (columns)];    \
        real *const of_speeds = out + MECHC_NQ * (columns);                                       \
        MECHC_RATES_BY(by, columns);                                                              \
        FN(response_##by)(t, q, u, given, a, l, response);                                        \
        for (int i = 0; i < MECHC_NU * (columns); i++) of_speeds[i] = response[i];                \
    }

#if MECHC_PARAMETER_JACOBIAN
MECHC_DEFINE_JACOBIAN(parameter_jacobian, by_parameters, MECHC_NP)
#if MECHC_OWN > 0
MECHC_DEFINE_OWN(parameter_jacobian, by_parameters, MECHC_NP)
#endif
#endif

#if MECHC_INPUT_JACOBIAN /* only where that by the state is asked for */
MECHC_DEFINE_JACOBIAN(input_jacobian, by_inputs, MECHC_NI)
#if MECHC_OWN > 0
MECHC_DEFINE_OWN(input_jacobian, by_inputs, MECHC_NI)
#endif
#endif
#undef MECHC_RATES_BY
#undef MECHC_DEFINE_JACOBIAN
#undef MECHC_DEFINE_RESPONSE
#undef MECHC_DEFINE_OWN

#endif
