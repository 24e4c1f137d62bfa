/* One stage of an integrator on the constraint manifold; generic over `real`.
 *
 * locate: configuration terms and rows at q.   close_loops: nearest q that closes the loops.
 * steady: nearest speeds that keep them closed.   accelerate: u' from M u' + J^T lambda = F and
 * J u' = gamma.
 */

typedef struct {
#if MECHC_NC > 0
    FN(factors) all; /* every row: speeds and accelerations */
#else
    FN(mass_factors) factored;
#endif
    real gap[MECHC_AT_LEAST_ONE(MECHC_NH)];
    real jacobian[MECHC_AT_LEAST_ONE(MECHC_NC * MECHC_NU)];
    real bias[MECHC_AT_LEAST_ONE(MECHC_NC)];
    real mass[MECHC_NU * MECHC_NU];
    real saved[MECHC_AT_LEAST_ONE(MECHC_SAVED)];
    int bad; /* speed with a vanishing mass pivot, or -1 */
} FN(place);

MECHC_INLINE void FN(locate)(real t, const real *q, const real *p, const real *k, FN(place) *place)
{
    FN(configuration)(t, q, p, k, place->gap, place->jacobian, place->bias, place->mass,
                      place->saved);
#if MECHC_NC > 0
    place->bad = -1;
    FN(factor_rows)(place->jacobian, place->mass, MECHC_NC, &place->all);
#else
    place->bad = FN(factor_mass)(place->mass, MECHC_NU, &place->factored);
#endif
}

/* The first speed that moves no mass by itself, or -1; the metric of the rows needs its mass. */
MECHC_INLINE int FN(find_massless)(FN(place) *place)
{
    for (int i = 0; place->bad < 0 && i < MECHC_NU; i++)
        if (R_ANY(~R_MASK(place->mass[i * MECHC_NU + i] > 0.0))) place->bad = i;
    return place->bad;
}

MECHC_INLINE void FN(coordinate_rates_of)(real t, const real *q, const real *u, const real *p,
                                          const real *k, real *rates)
{
#if MECHC_IDENTITY_KINEMATICS
    (void)t, (void)q, (void)p, (void)k;
    for (int i = 0; i < MECHC_NQ; i++) rates[i] = u[i];
#else
    FN(output_coordinate_rates)(t, q, u, p, k, rates);
#endif
}

#if MECHC_NC > 0
/* The least change that gives every row the value wanted. */
MECHC_INLINE void FN(least_step)(const FN(place) *place, const real *values, real *step)
{
#if RLANES == 1
    const int beside = FN(least_singular)(&place->all) < MECHC_BESIDE_CROSSING;
    if (__builtin_expect(beside, 0) && !FN(has_redundant)(&place->all)) {
        FN(least_work)(place->mass, place->jacobian, values, step);
        return;
    }
#endif
    FN(least_change)(&place->all, MECHC_NC, values, step);
}
#endif

#if MECHC_NH > 0
/* Largest gap of the configuration constraints, and the rounding that it is measured against. */
MECHC_INLINE double FN(gap)(const FN(place) *place, const real *q, double *rounding)
{
    real gap = R(0.0), terms = R(0.0);
    for (int i = 0; i < MECHC_NH; i++) {
        real sum = R(0.0);
        for (int j = 0; j < MECHC_NU; j++) {
            const real entry = place->jacobian[i * MECHC_NU + j];
            sum += R_SELECT(R_MASK(entry < 0.0), -entry, entry);
        }
        const real size = R_SELECT(R_MASK(place->gap[i] < 0.0), -place->gap[i], place->gap[i]);
        gap = R_SELECT(R_MASK(size > gap) | R_MASK(size != size), size, gap);
        terms = R_SELECT(R_MASK(sum > terms), sum, terms);
    }
    real turn = R(1.0);
    for (int j = 0; j < MECHC_NQ; j++) {
        const real size = R_SELECT(R_MASK(q[j] < 0.0), -q[j], q[j]);
        turn = R_SELECT(R_MASK(size > turn), size, turn);
    }
    *rounding = R_GREATEST(terms * turn) * (2.0 * 2.220446049250313e-16);
    return R_GREATEST(gap);
}

/* One Gauss-Newton correction of q, the least in the metric of the rows, along speeds that the
 * constraints on the motion allow: what they prescribe is not for the closure to change. */
MECHC_INLINE void FN(correct)(real t, real *q, const real *p, const real *k,
                              const FN(place) *place)
{
    real values[MECHC_NC], step[MECHC_NU];
    for (int i = 0; i < MECHC_NC; i++) values[i] = R(0.0);
    for (int i = 0; i < MECHC_NH; i++) values[i] = -place->gap[i];
    FN(least_step)(place, values, step);
#if MECHC_IDENTITY_KINEMATICS
    (void)t, (void)p, (void)k;
    for (int i = 0; i < MECHC_NQ; i++) q[i] += step[i];
#else
    real map[MECHC_NQ * MECHC_NU], still[MECHC_NU];
    for (int i = 0; i < MECHC_NU; i++) still[i] = R(0.0);
    FN(output_kinematic_matrix)(t, q, still, p, k, map);
    for (int i = 0; i < MECHC_NQ; i++)
        for (int j = 0; j < MECHC_NU; j++) q[i] += map[i * MECHC_NU + j] * step[j];
#endif
}
#endif

/* Close the loops by moving q; place is left at the final q.  Returns MECHC_RUNNING or a failure;
 * *iterations counts configurations computed. */
MECHC_INLINE int FN(close_loops)(real t, real *q, const real *p, const real *k, FN(place) *place,
                                 long *iterations)
{
#if MECHC_NH > 0
    double before = HUGE_VAL, rounding;
    for (int iteration = 0; iteration < 20; iteration++) {
        FN(locate)(t, q, p, k, place);
        ++*iterations;
        if (FN(find_massless)(place) >= 0) return MECHC_SINGULAR_MASS;
        const double gap = FN(gap)(place, q, &rounding);
        if (!(gap < HUGE_VAL)) return MECHC_NOT_FINITE;
        if (gap <= rounding || (gap <= 16.0 * rounding && gap >= 0.25 * before))
            return MECHC_RUNNING;
        before = gap;
        FN(correct)(t, q, p, k, place);
    }
    return MECHC_NOT_CLOSED;
#else
    FN(locate)(t, q, p, k, place);
    ++*iterations;
    return FN(find_massless)(place) >= 0 ? MECHC_SINGULAR_MASS : MECHC_RUNNING;
#endif
}

#if MECHC_NC > 0
MECHC_INLINE void FN(velocity_residual)(const FN(place) *place, const real *u, real *residual)
{
    for (int i = 0; i < MECHC_NC; i++) {
        residual[i] = place->bias[i];
        for (int j = 0; j < MECHC_NU; j++)
            residual[i] += place->jacobian[i * MECHC_NU + j] * u[j];
    }
}
#endif

/* The speeds nearest to u, in the metric of the rows, that satisfy the constraints. */
MECHC_INLINE void FN(steady)(const FN(place) *place, real *u)
{
#if MECHC_NC > 0
    real values[MECHC_NC], step[MECHC_NU];
    FN(velocity_residual)(place, u, values);
    for (int i = 0; i < MECHC_NC; i++) values[i] = -values[i];
    FN(least_step)(place, values, step);
    for (int i = 0; i < MECHC_NU; i++) u[i] += step[i];
#else
    (void)place, (void)u;
#endif
}

/* Accelerations, and the multipliers when asked for. */
MECHC_INLINE void FN(accelerate)(real t, const real *q, const real *u, const real *p, const real *k,
                                 const FN(place) *place, real *accelerations, real *lambda)
{
#if MECHC_NC > 0
    real forcing[MECHC_NU], gamma[MECHC_NC];
    const FN(motion_terms) terms = {place->mass, place->jacobian, forcing, gamma};
    FN(motion)(t, q, u, p, k, place->saved, forcing, gamma);
    FN(solve_motion)(&terms, &place->all, accelerations, lambda);
#else
    real none[1];
    (void)lambda;
    FN(motion)(t, q, u, p, k, place->saved, accelerations, none);
    FN(forward)(&place->factored, MECHC_NU, accelerations);
    FN(backward)(&place->factored, MECHC_NU, accelerations);
#endif
}

/* State rates at a state taken as it is. */
MECHC_INLINE void FN(rates)(real t, const real *y, const real *p, const real *k, real *out)
{
    FN(place) place;
    FN(locate)(t, y, p, k, &place);
    FN(coordinate_rates_of)(t, y, y + MECHC_NQ, p, k, out);
    FN(accelerate)(t, y, y + MECHC_NQ, p, k, &place, out + MECHC_NQ, 0);
}
