/* One stage of an integrator on the constraint manifold; generic over `real`.
 *
 * locate: configuration terms and rows at q.   close_loops: nearest q that closes the loops.
 * steady: nearest speeds that keep them closed.   accelerate: u' from M u' + J^T lambda = F and
 * J u' = gamma.
 */
#include "simd/real.h"
#if R_VECTOR ? !defined MECHC_STAGE_VECTOR : !defined MECHC_STAGE_SCALAR
#if R_VECTOR
#define MECHC_STAGE_VECTOR
#else
#define MECHC_STAGE_SCALAR
#endif
#include "abi/codes.h"
#include "abi/inputs.h"
#include "dynamics/loops/blocks.h"
#include "dynamics/given.h"
#include "dynamics/linear.h"
#include "dynamics/loops/motion.h"
#include "dynamics/motion.h"
#include "dynamics/tree.h"
#include "scene_program.h"

/* Compute the constants of given parameters. */
MECHC_INLINE void FN(make_constants)(FN(given) *given)
{
    FN(hoist)(given->p, given->k);
    given->forces = 0;
    given->count = 0;
    given->k[MECHC_ROWS_THAT_COUNT] = R((double)MECHC_NC);
    given->k[MECHC_ORDINARY_LENGTH] = given->k[MECHC_ORDINARY_SUM] = R(0.0);
    given->k[MECHC_LENGTH] = R(1.0);
}

#if !R_VECTOR
MECHC_INLINE void mechc_give(const double *p, const mechc_inputs *inputs, mechc_scalar_given *given)
{
    for (int i = 0; i < MECHC_NP; i++) given->p[i] = p[i];
    given->inputs[0] = inputs;
    given->stop = 0;
    mechc_scalar_make_constants(given);
}
#endif

typedef struct {
#if MECHC_NC_MAX > 0
    real rank;       /* rows that count */
    real ordinary_length, ordinary_sum; /* see ordinary_rows.h */
    real length;     /* see ordinary_rows.h */
    FN(solver) rows; /* every one of them: speeds and accelerations */
#else
#if MECHC_ARTICULATED
    FN(articulated) articulated;
#endif
#if !MECHC_ARTICULATED || MECHC_SPEEDS_SHARED_CODE
    FN(mass_factors) factored;
#endif
#endif
    real gap[MECHC_AT_LEAST_ONE(MECHC_NH_MAX)];
    real jacobian[MECHC_AT_LEAST_ONE(MECHC_NC_MAX * MECHC_NU_MAX)];
    real bias[MECHC_AT_LEAST_ONE(MECHC_NC_MAX)];
#if !MECHC_ARTICULATED || MECHC_SPEEDS_SHARED_CODE
    real mass[MECHC_NU_MAX * MECHC_NU_MAX];
#endif
    real saved[MECHC_AT_LEAST_ONE(MECHC_SAVED_MAX)];
    int bad; /* speed with a vanishing mass pivot, or -1 */
} FN(place);

#if MECHC_NC_MAX > 0
MECHC_INLINE void FN(give_ordinary)(const FN(given) *given, FN(place) *place)
{
    place->ordinary_length = given->k[MECHC_ORDINARY_LENGTH];
    place->ordinary_sum = given->k[MECHC_ORDINARY_SUM];
    place->length = given->k[MECHC_LENGTH];
}

MECHC_INLINE void FN(prepare)(FN(place) *place, double least)
{
#if MECHC_WALKED
    (void)least;
    FN(prepare_rows)(place->saved, place->jacobian, place->mass, place->rank, &place->rows);
#else
    FN(prepare_rows)(place->jacobian, place->mass, place->length, place->rank, place->ordinary_length,
                     least, &place->rows);
#endif
}
#endif

/* Locate a stage. turns: three numbers an angle, where its sine and cosine are kept, or NULL; near: they are
 * kept from a configuration near this one; least: squared share of the longest row below which a row is
 * redundant, 0: the rows are known to be far from dependent. */
MECHC_OF_STAGE void FN(locate_near)(real t, const real *q, const FN(given) *given,
                                    FN(place) *place, real *turns, int near, double least)
{
#if MECHC_WALKED
    real *const jacobian = 0, *const mass = 0;
#else
    real *const jacobian = place->jacobian, *const mass = place->mass;
#endif
    FN(configuration)(t, q, given, place->gap, jacobian, place->bias, mass, place->saved, turns,
                      near);
#if MECHC_NC_MAX > 0
    place->bad = -1;
    place->rank = given->k[MECHC_ROWS_THAT_COUNT];
    FN(give_ordinary)(given, place);
    FN(prepare)(place, least);
#else
    (void)least;
#if MECHC_ARTICULATED
    if (!MECHC_SPEEDS_SHARED) {
        place->bad = FN(articulate)(place->saved, &place->articulated);
        return;
    }
#endif
#if MECHC_FREE_TREE && MECHC_SPEEDS_SHARED_CODE
    FN(composite_mass)(place->saved, place->mass);
#endif
#if !MECHC_ARTICULATED || MECHC_SPEEDS_SHARED_CODE
    place->bad = FN(factor_mass)(place->mass, MECHC_NU, &place->factored);
#endif
#endif
}

MECHC_INLINE void FN(locate)(real t, const real *q, const FN(given) *given, FN(place) *place)
{
    FN(locate_near)(t, q, given, place, 0, 0, MECHC_REDUNDANT);
}

#if MECHC_NC_MAX > 0
/* Evaluate gap, rows and mass matrix, whichever way the rows are solved. */
MECHC_ONCE void FN(locate_all)(real t, const real *q, const FN(given) *given, FN(place) *place)
{
    FN(configuration)(t, q, given, place->gap, place->jacobian, place->bias, place->mass,
                      place->saved, 0, 0);
    FN(give_ordinary)(given, place);
}
#endif

/* The first speed that moves no mass by itself, or -1.  Where the motion is solved in its free directions it
 * may: what these move is divided by. */
MECHC_INLINE int FN(find_massless)(FN(place) *place)
{
#if MECHC_NC_MAX > 0 && MECHC_WALKED
    if (!place->rows.together) return place->bad;
#endif
#if !MECHC_FREE_TREE
    for (int i = 0; place->bad < 0 && i < MECHC_NU; i++)
#if MECHC_ONE_FREEDOM
        if (R_ANY(~R_MASK(place->mass[i * MECHC_NU + i] >= 0.0))) place->bad = i;
#else
        if (R_ANY(~R_MASK(place->mass[i * MECHC_NU + i] > 0.0))) place->bad = i;
#endif
#endif
    return place->bad;
}

MECHC_INLINE void FN(coordinate_rates_of)(real t, const real *q, const real *u,
                                          const FN(given) *given, real *rates)
{
    if (!MECHC_IDENTITY_KINEMATICS) {
#if MECHC_KINEMATICS_CODE
        FN(output_coordinate_rates)(t, q, u, given, rates);
#endif
        return;
    }
    for (int i = 0; i < MECHC_NQ; i++) rates[i] = u[i];
    (void)t, (void)q, (void)given;
}

/* The matrix of q' by u. */
MECHC_INLINE void FN(map_of)(real t, const real *q, const FN(given) *given, real *map)
{
#if MECHC_KINEMATICS_CODE
    real still[MECHC_NU_MAX];
    for (int i = 0; i < MECHC_NU; i++) still[i] = R(0.0);
    FN(output_kinematic_matrix)(t, q, still, given, map);
#else
    (void)t, (void)q, (void)given, (void)map;
#endif
}

#if MECHC_NC_MAX > 0
MECHC_INLINE void FN(least_step_at)(const FN(place) *place, const real *values, real *step)
{
#if MECHC_WALKED
    FN(least_step)(place->saved, &place->rows, values, step);
#else
    FN(least_step)(place->jacobian, place->mass, &place->rows, values, step);
#endif
}

/* Where several loops become singular at once, the rounding of all of them adds up, so the
 * conditioning of a tree with several is taken as this much worse.  Found with 5 to 40 windows in a
 * row at tolerances from 1e-6 to 1e-12. */
#define MECHC_TOGETHER (MECHC_SEVERAL_LOOPS ? 0.05 : 1.0)

/* The conditioning of the rows, squared. */
MECHC_INLINE real FN(conditioning_at)(const FN(place) *place)
{
#if MECHC_WALKED
    return MECHC_TOGETHER * MECHC_TOGETHER * FN(conditioning_squared)(&place->rows);
#else
    return FN(conditioning_squared)(place->jacobian, place->mass, place->length,
                                    place->ordinary_length, &place->rows);
#endif
}

MECHC_INLINE real FN(conditioning)(const FN(place) *place)
{
    return R_SQRT(FN(conditioning_at)(place));
}

/* The distance of a critical configuration, squared.  Where rows are eliminated block by block, it
 * is the sines of the blocks: these are angles, which change by no more than links turn, and do not
 * depend on masses.  Elsewhere it is the conditioning of all rows. */
MECHC_INLINE real FN(regularity_at)(const FN(place) *place)
{
#if MECHC_BLOCKS_CODE
    if (MECHC_ROW_BLOCKS > 0) {
        const rmask clear = place->rows.clear;
        if (!R_ANY(~clear)) return R(MECHC_SAFE_SINE);
        return R_SELECT(clear, R(MECHC_SAFE_SINE), FN(conditioning_at)(place));
    }
#endif
    return FN(conditioning_at)(place);
}

#define MECHC_MAY_HAVE_ONE_ROW \
    (!MECHC_WALKED && MECHC_NC_MAX > 1 && (MECHC_NH_MAX == 1 || MECHC_GENERAL))
#if MECHC_MAY_HAVE_ONE_ROW
/* The conditioning of the only configuration row, beside which there are velocity constraints. */
MECHC_INLINE real FN(conditioning_of_row)(const FN(place) *place)
{
    real square = R(0.0), moved[MECHC_NU_MAX];
    FN(moved_masses)(place->mass, place->length, moved);
    for (int k = 0; k < MECHC_NU; k++) {
        const real entry = place->jacobian[k];
        square += entry * entry / moved[k];
    }
    return R_SQRT(square / FN(larger)(square, place->ordinary_length));
}
#endif

/* J x */
MECHC_INLINE void FN(rates_of_rows)(const FN(place) *place, const real *x, real *rates)
{
#if MECHC_WALKED
    FN(cut_rates)(place->saved, x, rates);
#else
#if MECHC_BLOCKS_CODE
    if (MECHC_ROW_BLOCKS > 0) {
        FN(rates_in_blocks)(place->jacobian, x, rates);
        return;
    }
#endif
    for (int i = 0; i < MECHC_NC; i++) {
        rates[i] = R(0.0);
        for (int j = 0; j < MECHC_NU; j++) R_ADD(rates[i], place->jacobian[i * MECHC_NU + j], x[j]);
    }
#endif
}
#endif

#if MECHC_NH_MAX > 0
MECHC_INLINE real FN(size)(real x) { return R_SELECT(R_MASK(x < 0.0), -x, x); }

/* The unit in which component i of a state is measured. */
MECHC_INLINE real FN(unit_of)(const FN(place) *place, int i)
{
    (void)place, (void)i;
    return MECHC_SLIDES_AT(i) ? place->length : R(1.0);
}

/* The largest sum of a row's entries, in units of the speeds. */
MECHC_INLINE real FN(sum_of_partials)(const FN(place) *place)
{
#if MECHC_WALKED
    return FN(most_partials)(place->saved, place->length);
#elif MECHC_BLOCKS_CODE && !defined MECHC_SLIDES
    return FN(partials_in_blocks)(place->jacobian);
#else
    real terms = R(0.0);
    for (int i = 0; i < MECHC_NH; i++) {
        real sum = R(0.0);
        for (int j = 0; j < MECHC_NU; j++)
            R_ADD(sum, FN(size)(place->jacobian[i * MECHC_NU + j]), FN(unit_of)(place, MECHC_NQ + j));
        terms = R_SELECT(R_MASK(sum > terms), sum, terms);
    }
    return terms;
#endif
}

/* The largest gap of the configuration constraints, and the rounding that it is compared with. */
MECHC_INLINE real FN(gap_and_rounding)(const FN(place) *place, const real *q, real *rounding)
{
    real gap = R(0.0), turn = R(1.0);
    const real terms = FN(larger)(FN(sum_of_partials)(place), place->ordinary_sum);
    for (int i = 0; i < MECHC_NH; i++) {
        const real size = FN(size)(place->gap[i]);
        gap = R_SELECT(R_MASK(size > gap) | R_MASK(size != size), size, gap);
    }
    for (int j = 0; j < MECHC_NQ - MECHC_STATES; j++) {
        const real size = MECHC_SLIDES_AT(j) ? FN(size)(q[j]) / place->length : FN(size)(q[j]);
        turn = R_SELECT(R_MASK(size > turn), size, turn);
    }
    *rounding = terms * turn * (2.0 * DBL_EPSILON);
    return gap;
}

MECHC_INLINE double FN(gap)(const FN(place) *place, const real *q, double *rounding)
{
    real each;
    const real gap = FN(gap_and_rounding)(place, q, &each);
    *rounding = R_GREATEST(each);
    return R_GREATEST(gap);
}

/* The change of the rows that a correction of q must make; 0 for velocity constraints. */
MECHC_INLINE void FN(gap_values)(const FN(place) *place, real *values)
{
    for (int i = 0; i < MECHC_NC; i++) values[i] = R(0.0);
    for (int i = 0; i < MECHC_NH; i++) values[i] = -place->gap[i];
}

/* Move q by a step of the speeds. */
MECHC_INLINE void FN(displace)(real t, real *q, const FN(given) *given, const real *step)
{
    if (MECHC_IDENTITY_KINEMATICS) {
        for (int i = 0; i < MECHC_NQ; i++) q[i] += step[i];
        return;
    }
    real map[MECHC_NQ_MAX * MECHC_NU_MAX];
    FN(map_of)(t, q, given, map);
    for (int i = 0; i < MECHC_NQ; i++)
        for (int j = 0; j < MECHC_NU; j++) R_ADD(q[i], map[i * MECHC_NU + j], step[j]);
}

/* One Gauss-Newton correction of q, the least in the metric of the rows. */
MECHC_INLINE void FN(correct)(real t, real *q, const FN(given) *given, const FN(place) *place)
{
    real values[MECHC_NC_MAX], step[MECHC_NU_MAX];
    FN(gap_values)(place, values);
    FN(least_step_at)(place, values, step);
    FN(displace)(t, q, given, step);
}

/* A correction of q that leaves gaps within so many units of rounding: noise would be magnified
 * from one iteration to the next. */
MECHC_INLINE void FN(correct_beyond)(real t, real *q, const FN(given) *given,
                                     const FN(place) *place, double units)
{
    real values[MECHC_NC_MAX], step[MECHC_NU_MAX], rounding;
    const real gap = FN(gap_and_rounding)(place, q, &rounding);
    const rmask shows = ~R_MASK(gap <= units * rounding);
    FN(gap_values)(place, values);
    for (int i = 0; i < MECHC_NH; i++) values[i] = R_SELECT(shows, values[i], R(0.0));
    FN(least_step_at)(place, values, step);
    FN(displace)(t, q, given, step);
}
#endif

/* Close the loops by moving q; place is left at the final q.  Returns MECHC_RUNNING or a failure;
 * *iterations counts configurations computed. */
MECHC_INLINE int FN(close_loops)(real t, real *q, const FN(given) *given, FN(place) *place,
                                 long *iterations)
{
#if MECHC_NH_MAX > 0
    double before = HUGE_VAL, rounding;
    real turns[MECHC_AT_LEAST_ONE(3 * MECHC_TURNS_MAX)];
    for (int iteration = 0; iteration < 20; iteration++) {
        FN(locate_near)(t, q, given, place, turns, iteration > 0, MECHC_REDUNDANT);
        ++*iterations;
        if (FN(find_massless)(place) >= 0) return MECHC_SINGULAR_MASS;
        const double gap = FN(gap)(place, q, &rounding);
        if (!(gap < HUGE_VAL)) return MECHC_NOT_FINITE;
        if (gap <= rounding || (gap <= MECHC_CLOSES * rounding && gap >= 0.25 * before))
            return MECHC_RUNNING;
        before = gap;
        FN(correct)(t, q, given, place);
    }
    return MECHC_NOT_CLOSED;
#else
    FN(locate)(t, q, given, place);
    ++*iterations;
    return FN(find_massless)(place) >= 0 ? MECHC_SINGULAR_MASS : MECHC_RUNNING;
#endif
}

#if MECHC_NC_MAX > 0
MECHC_INLINE void FN(velocity_residual)(const FN(place) *place, const real *u, real *residual)
{
    FN(rates_of_rows)(place, u, residual);
    for (int i = 0; i < MECHC_NC; i++) residual[i] += place->bias[i];
}
#endif

/* The speeds nearest to u, in the metric of the rows, that satisfy the constraints. */
MECHC_INLINE void FN(steady)(const FN(place) *place, real *u)
{
#if MECHC_NC_MAX > 0
    real values[MECHC_NC_MAX], step[MECHC_NU_MAX];
    FN(velocity_residual)(place, u, values);
    for (int i = 0; i < MECHC_NC; i++) values[i] = -values[i];
    FN(least_step_at)(place, values, step);
    for (int i = 0; i < MECHC_NU; i++) u[i] += step[i];
#else
    (void)place, (void)u;
#endif
}

/* Accelerations, and multipliers on request. */
MECHC_OF_STAGE void FN(accelerate)(real t, const real *q, const real *u, const FN(given) *given,
                                   const FN(place) *place, real *accelerations, real *lambda)
{
#if MECHC_NC_MAX > 0 && MECHC_WALKED
    real gamma[MECHC_NC_MAX], bias[MECHC_LINKS_MAX * MECHC_DIM_MAX], wrench[MECHC_LINKS_MAX * MECHC_DIM_MAX];
    FN(tree_motion)(t, q, u, given, place->saved + MECHC_AT_SAVED, bias, wrench, gamma);
    FN(take_bias)(place->saved, bias, wrench);
    FN(solve_motion)(place->saved, &place->rows, wrench, gamma, accelerations, lambda);
#elif MECHC_NC_MAX > 0
    real forcing[MECHC_NU_MAX], gamma[MECHC_NC_MAX];
    const FN(motion_terms) terms = {place->mass, place->jacobian, forcing, gamma, place->rank,
                                     place->length};
    FN(motion)(t, q, u, given, place->saved, forcing, gamma);
    FN(solve_motion)(&terms, &place->rows, accelerations, lambda);
#else
    real none[1];
    (void)lambda;
#if MECHC_ARTICULATED
    real bias[MECHC_LINKS_MAX * MECHC_DIM_MAX], wrench[MECHC_LINKS_MAX * MECHC_DIM_MAX];
    if (!MECHC_SPEEDS_SHARED) {
        FN(tree_motion)(t, q, u, given, place->saved + MECHC_AT_SAVED, bias, wrench, none);
        FN(free_accelerations)(place->saved, &place->articulated, bias, wrench, accelerations);
        return;
    }
#endif
#if !MECHC_ARTICULATED || MECHC_SPEEDS_SHARED_CODE
    FN(motion)(t, q, u, given, place->saved, accelerations, none);
    FN(forward)(&place->factored, MECHC_NU, accelerations);
    FN(backward)(&place->factored, MECHC_NU, accelerations);
#endif
#endif
}
#endif
