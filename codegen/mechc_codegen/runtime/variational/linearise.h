/* Derivatives of the rates and of the projection onto the constraints at a state; generic over
 * `real`.
 *
 * Rows of MECHC_SLOPES numbers: by the state, then by parameters and by values of inputs.  At a
 * state on the constraints Phi(q, p) = 0 and J u + b = 0 columns S of derivatives keep
 *     Phi_q S_q + Phi_p = 0,    J S_u + (J u + b)_q S_q + (J u + b)_p = 0;
 * the least change in the metric of the mass matrix makes them do so, as it does with states.
 */
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_LINEARISE_VECTOR : !defined MECHC_LINEARISE_SCALAR
#if R_VECTOR
#define MECHC_LINEARISE_VECTOR
#else
#define MECHC_LINEARISE_SCALAR
#endif
#include "dynamics/stage.h"
#include "scene_program.h"
#include "variational/respond.h"
#include "variational/sizes.h"

#if MECHC_VARIATIONAL
#define MECHC_ROOM(rows, columns) MECHC_AT_LEAST_ONE((rows) * (columns))

/* Copy rows x columns, with a stride of MECHC_SLOPES, from an array without gaps. */
MECHC_INLINE void FN(put_columns)(const real *from, int rows, int columns, real *to)
{
    for (int i = 0; i < rows; i++)
        for (int k = 0; k < columns; k++) to[i * MECHC_SLOPES + k] = from[i * columns + k];
}

/* to <- to + sign a b: a (rows x inner), b (inner x columns) and to with these strides. */
MECHC_INLINE void FN(add_product)(double sign, const real *a, int a_stride, const real *b,
                                  int b_stride, int rows, int inner, int columns, real *to)
{
    for (int i = 0; i < rows; i++)
        for (int m = 0; m < inner; m++) {
            const real factor = sign * a[i * a_stride + m];
            for (int k = 0; k < columns; k++)
                R_ADD(to[i * MECHC_SLOPES + k], factor, b[m * b_stride + k]);
        }
}

#if MECHC_NC_MAX > 0
/* The accelerations (NU x NC) that a value 1 of each row causes: the least change. */
MECHC_INLINE void FN(least_changes)(const FN(place) *place, real *changes)
{
    real unit[MECHC_MOTION_MAX * MECHC_NC_MAX];
    for (int i = 0; i < MECHC_MOTION; i++)
        for (int k = 0; k < MECHC_NC; k++)
            unit[i * MECHC_NC + k] = R(i == MECHC_NU + k ? -1.0 : 0.0);
    FN(respond_with)(place, unit, MECHC_NC, 0, changes);
}
#endif

/* Derivatives of the accelerations by `columns` inputs, from those of the residual. */
MECHC_INLINE void FN(put_response)(const FN(place) *place, const real *responses,
                                   const real *residual, int columns, real *to)
{
#if MECHC_NC_MAX > 0 && !MECHC_WALKED
    (void)place;
    for (int i = 0; i < MECHC_NU; i++)
        for (int k = 0; k < columns; k++) {
            real sum = responses[i * MECHC_MOTION] * residual[k];
            for (int m = 1; m < MECHC_MOTION; m++)
                R_ADD(sum, responses[i * MECHC_MOTION + m], residual[m * columns + k]);
            to[i * MECHC_SLOPES + k] = -sum;
        }
#else
    real response[MECHC_ROOM(MECHC_NU_MAX, MECHC_NX_MAX + MECHC_NB_MAX)];
    (void)responses;
    response[0] = R(0.0); /* of no speed */
    FN(respond_with)(place, residual, columns, 0, response);
    FN(put_columns)(response, MECHC_NU, columns, to);
#endif
}

/* Derivatives of q' by inputs that are not states. */
#if !MECHC_KINEMATICS_CODE
#define MECHC_PUT_RATES(by, columns, first) (void)0
#else
#define MECHC_PUT_RATES(by, columns, first)                                                       \
    do {                                                                                          \
        if (MECHC_IDENTITY_KINEMATICS) break;                                                     \
        real rate[MECHC_ROOM(MECHC_NQ_MAX, columns)];                                             \
        FN(output_rate_##by)(t, y, y + MECHC_NQ, given, rate);                                    \
        FN(put_columns)(rate, MECHC_NQ, columns, slopes + (first));                               \
    } while (0)
#endif
#define MECHC_PUT_SLOPES(by, columns, first)                                                      \
    do {                                                                                          \
        real residual[MECHC_ROOM(MECHC_MOTION_MAX, columns)];                                     \
        FN(solved_residual_##by)(t, y, y + MECHC_NQ, given, a, l, residual);                      \
        FN(put_response)(place, responses, residual, columns,                                     \
                         slopes + MECHC_NQ * MECHC_SLOPES + (first));                             \
        MECHC_PUT_RATES(by, columns, first);                                                      \
    } while (0)

/* Derivatives of the rates, NX rows, where the motion was solved. */
MECHC_INLINE void FN(put_slopes)(real t, const real *y, const FN(given) *given,
                                 const FN(place) *place, const real *a, const real *l,
                                 real *slopes)
{
    real responses[MECHC_ROOM(MECHC_NU_MAX, MECHC_MOTION_MAX)];
#if MECHC_NC_MAX > 0 && !MECHC_WALKED
    real unit[MECHC_MOTION_MAX * MECHC_MOTION_MAX];
    for (int i = 0; i < MECHC_MOTION; i++)
        for (int k = 0; k < MECHC_MOTION; k++)
            unit[i * MECHC_MOTION + k] = R(i == k ? -1.0 : 0.0);
    FN(respond_with)(place, unit, MECHC_MOTION, 0, responses);
#endif
    for (int i = 0; MECHC_IDENTITY_KINEMATICS && i < MECHC_NQ; i++)
        for (int k = 0; k < MECHC_SLOPES; k++)
            slopes[i * MECHC_SLOPES + k] = R(k == MECHC_NQ + i ? 1.0 : 0.0);
    MECHC_PUT_SLOPES(by_state, MECHC_NX, 0);
#if MECHC_GENERAL || MECHC_PARAMETER_JACOBIAN
    if (MECHC_NP > 0) MECHC_PUT_SLOPES(by_parameters, MECHC_NP, MECHC_NX);
#endif
#if MECHC_GENERAL || MECHC_INPUT_JACOBIAN
    if (MECHC_NI > 0) MECHC_PUT_SLOPES(by_inputs, MECHC_NI, MECHC_NX + MECHC_NP);
#endif
}
#undef MECHC_PUT_RATES
#undef MECHC_PUT_SLOPES

#if MECHC_NC_MAX > 0
#define MECHC_PUT_CONSTRAINTS(name, rows, columns, first, to)                                     \
    do {                                                                                          \
        real part[MECHC_ROOM(rows, columns)];                                                     \
        FN(output_##name)(t, y, y + MECHC_NQ, given, part);                                       \
        FN(put_columns)(part, rows, columns, (to) + (first));                                     \
    } while (0)

/* Derivatives of the configuration constraints, NH rows, by q and by parameters and inputs. */
MECHC_INLINE void FN(put_gap_slopes)(real t, const real *y, const FN(given) *given,
                                     const real *jacobian, real *gaps)
{
    for (int i = 0; i < MECHC_NH * MECHC_SLOPES; i++) gaps[i] = R(0.0);
    (void)t, (void)y, (void)given;
#ifdef MECHC_GRADIENT
    if (MECHC_GRADIENT) MECHC_PUT_CONSTRAINTS(constraint_gradient, MECHC_NH, MECHC_NQ, 0, gaps);
    else
#endif
        FN(put_columns)(jacobian, MECHC_NH, MECHC_NH > 0 ? MECHC_NQ : 0, gaps);
#ifdef MECHC_GAP_BY_PARAMETERS
    if (MECHC_GAP_BY_PARAMETERS)
        MECHC_PUT_CONSTRAINTS(constraints_by_parameters, MECHC_NH, MECHC_NP, MECHC_NX, gaps);
#endif
#ifdef MECHC_GAP_BY_INPUTS
    if (MECHC_GAP_BY_INPUTS)
        MECHC_PUT_CONSTRAINTS(constraints_by_inputs, MECHC_NH, MECHC_NI, MECHC_NX + MECHC_NP, gaps);
#endif
}

/* Derivatives of J u + b, NC rows, by the state, parameters and inputs. */
MECHC_INLINE void FN(put_speed_slopes)(real t, const real *y, const FN(given) *given,
                                       const real *jacobian, real *rates)
{
    for (int i = 0; i < MECHC_NC * MECHC_SLOPES; i++) rates[i] = R(0.0);
    MECHC_PUT_CONSTRAINTS(velocity_gradient, MECHC_NC, MECHC_NQ, 0, rates);
    FN(put_columns)(jacobian, MECHC_NC, MECHC_NU, rates + MECHC_NQ);
#ifdef MECHC_GAP_RATE_BY_PARAMETERS
    if (MECHC_GAP_RATE_BY_PARAMETERS)
        MECHC_PUT_CONSTRAINTS(velocity_constraints_by_parameters, MECHC_NC, MECHC_NP, MECHC_NX, rates);
#endif
#ifdef MECHC_GAP_RATE_BY_INPUTS
    if (MECHC_GAP_RATE_BY_INPUTS)
        MECHC_PUT_CONSTRAINTS(velocity_constraints_by_inputs, MECHC_NC, MECHC_NI,
                              MECHC_NX + MECHC_NP, rates);
#endif
}
#undef MECHC_PUT_CONSTRAINTS

/* The derivative of the projection: NX rows P | Q with which columns S become P S + Q. */
MECHC_INLINE void FN(put_tangent)(real t, const real *y, const FN(given) *given,
                                  const FN(place) *place, real *tangent)
{
    real changes[MECHC_NU_MAX * MECHC_NC_MAX], jacobian[MECHC_NC_MAX * MECHC_NU_MAX];
    real rates[MECHC_NC_MAX * MECHC_SLOPES_MAX], total[MECHC_NC_MAX * MECHC_SLOPES_MAX];
    real *const of_speeds = tangent + MECHC_NQ * MECHC_SLOPES;
    FN(least_changes)(place, changes);
    FN(output_constraint_jacobian)(t, y, y + MECHC_NQ, given, jacobian);
    for (int i = 0; i < MECHC_NX; i++)
        for (int k = 0; k < MECHC_SLOPES; k++) tangent[i * MECHC_SLOPES + k] = R(i == k ? 1.0 : 0.0);
#if MECHC_NH_MAX > 0
    real gaps[MECHC_NH_MAX * MECHC_SLOPES_MAX];
    FN(put_gap_slopes)(t, y, given, jacobian, gaps);
    if (MECHC_IDENTITY_KINEMATICS)
        FN(add_product)(-1.0, changes, MECHC_NC, gaps, MECHC_SLOPES, MECHC_NQ, MECHC_NH, MECHC_SLOPES,
                        tangent);
#if MECHC_KINEMATICS_CODE
    real map[MECHC_NQ_MAX * MECHC_NU_MAX], steps[MECHC_NQ_MAX * MECHC_NH_MAX];
    if (!MECHC_IDENTITY_KINEMATICS) {
        FN(output_kinematic_matrix)(t, y, y + MECHC_NQ, given, map);
        for (int i = 0; i < MECHC_NQ * MECHC_NH; i++) {
            steps[i] = R(0.0);
            for (int m = 0; m < MECHC_NU; m++)
                R_ADD(steps[i], map[i / MECHC_NH * MECHC_NU + m],
                      changes[m * MECHC_NC + i % MECHC_NH]);
        }
        FN(add_product)(-1.0, steps, MECHC_NH, gaps, MECHC_SLOPES, MECHC_NQ, MECHC_NH,
                        MECHC_SLOPES, tangent);
    }
#endif
#endif
    FN(put_speed_slopes)(t, y, given, jacobian, rates);
    for (int i = 0; i < MECHC_NC; i++) /* where the coordinates moved too */
        for (int k = 0; k < MECHC_SLOPES; k++)
            total[i * MECHC_SLOPES + k] = k < MECHC_NQ ? R(0.0) : rates[i * MECHC_SLOPES + k];
    FN(add_product)(1.0, rates, MECHC_SLOPES, tangent, MECHC_SLOPES, MECHC_NC, MECHC_NQ,
                    MECHC_SLOPES, total);
    FN(add_product)(-1.0, changes, MECHC_NC, total, MECHC_SLOPES, MECHC_NU, MECHC_NC,
                    MECHC_SLOPES, of_speeds);
}
#endif

/* The rates and, in NX rows, their derivatives; along the constraints: those of the rates of the
 * projected state. */
MECHC_ONCE void FN(linearise)(real t, const real *y, const FN(given) *given, rmask along,
                              real *rates, real *slopes)
{
    FN(place) place;
    real l[MECHC_AT_LEAST_ONE(MECHC_NC_MAX)];
    FN(locate)(t, y, given, &place);
    FN(accelerate)(t, y, y + MECHC_NQ, given, &place, rates + MECHC_NQ, l);
    FN(coordinate_rates_of)(t, y, y + MECHC_NQ, given, rates);
    FN(put_slopes)(t, y, given, &place, rates + MECHC_NQ, l, slopes);
#if MECHC_NC_MAX > 0
    if (!R_ANY(along)) return;
    real tangent[MECHC_NX_MAX * MECHC_SLOPES_MAX], plain[MECHC_NX_MAX * MECHC_SLOPES_MAX];
    FN(put_tangent)(t, y, given, &place, tangent);
    for (int i = 0; i < MECHC_NX; i++)
        for (int k = 0; k < MECHC_SLOPES; k++) {
            const int at = i * MECHC_SLOPES + k;
            plain[at] = slopes[at];
            if (k < MECHC_NX) slopes[at] = R(0.0);
        }
    FN(add_product)(1.0, plain, MECHC_SLOPES, tangent, MECHC_SLOPES, MECHC_NX, MECHC_NX,
                    MECHC_SLOPES, slopes);
    for (int i = 0; i < MECHC_NX * MECHC_SLOPES; i++)
        slopes[i] = R_SELECT(along, slopes[i], plain[i]);
#else
    (void)along;
#endif
}

#if MECHC_NC_MAX > 0
MECHC_ONCE void FN(tangent)(real t, const real *y, const FN(given) *given, real *tangent)
{
    FN(place) place;
    FN(locate)(t, y, given, &place);
    FN(put_tangent)(t, y, given, &place, tangent);
}

/* The conditioning, squared. */
MECHC_ONCE real FN(conditioning_there)(real t, const real *y, const FN(given) *given)
{
#if MECHC_NH_MAX > 0
    FN(place) place;
    FN(locate)(t, y, given, &place);
    return FN(conditioning_at)(&place);
#else
    (void)t, (void)y, (void)given;
    return R(0.0); /* rows of velocities alone are kept always */
#endif
}
#endif
#endif
#endif
