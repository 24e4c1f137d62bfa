/* The stages of a collocation step, side by side in the lanes: values, closure of loops, rates, and
 * one fixed-point iteration.  See gauss.h for the method. */
#pragma once

#include "methods/gauss/tableau.h"
#include "singularities/fine_gap.h"
#include "simd/bind_vector.h"
#include "dynamics/stage.h"
#include "simd/unbind.h"
#include "simd/scalar.h"
#include "simd/vector.h"

#define MECHC_BLOCKS (MECHC_STAGES / MECHC_LANES)
#define MECHC_UNKNOWNS (MECHC_IDENTITY_KINEMATICS ? MECHC_NU : MECHC_NX)
#define MECHC_UNKNOWNS_MAX (MECHC_KINEMATICS_CODE ? MECHC_NX_MAX : MECHC_NU_MAX)
#define MECHC_FIRST_UNKNOWN (MECHC_NX - MECHC_UNKNOWNS) /* the component it is the rate of */

#define MECHC_GAUSS_LOOSEST 3e-7 /* changes, in scales, that end the iteration however loose the tolerance */
#define MECHC_GAUSS_LEFT 0.1 /* of the tolerance, to the iteration */
#define MECHC_GAUSS_FASTEST 0.1 /* the first changes shrink faster than later ones */
#define MECHC_GAUSS_STALLS (2.0 / 3.0) /* small changes that shrink by less are rounding */
#define MECHC_GAUSS_HOPELESS 3.0 /* error after three iterations of a step that is rejected at once */
#define MECHC_GAUSS_MOST_LEFT 8.0 /* units of rounding that gaps of stages are left at */
/* Changes that may be rounding, in scales: of rates where loops are well conditioned, where there are
 * none, and scales of a coordinate beyond which its last digit shows. */
#define MECHC_GAUSS_DIGIT (MECHC_NC > 2 ? 5e-14 : 4e-15)
#define MECHC_GAUSS_DIGITS_FREE 2.5
#define MECHC_GAUSS_LARGE 8.0
#define MECHC_GAUSS_SAFETY 1e3 /* of the coefficients' squares as a measure of the end's error */
/* Differences of the rates at a step's ends from the polynomial's, in sums of its two coefficients of
 * highest degree: those of coefficients that shrink by a sixth from degree to degree. */
#define MECHC_GAUSS_CONTINUES 8.0

/* Stability limits the steps where the iteration converges slowly although the steps are far more
 * accurate than requested. */
#define MECHC_GAUSS_SLOW 0.2
#define MECHC_GAUSS_NEEDLESS 0.01
#define MECHC_GAUSS_LIMITED 2 /* such steps in a row, and Newton's iteration takes over */

/* Ways of keeping stages on the constraints: not at all, or closed after or before their rates. */
enum { MECHC_UNPROJECTED, MECHC_CLOSE_AFTER, MECHC_CLOSE_BEFORE };

/* Integral and second integral to the step's end, Legendre coefficients of degrees 7 and 6. */
typedef double mechc_sums __attribute__((vector_size(32)));
/* x <- x + a b of such sums, as MECHC_ADD of lanes; no functions, which pass no vectors so wide everywhere. */
#if defined __FMA__ && !defined __clang__
#define MECHC_ADD_SUMS(x, a, b) ((x) = __builtin_ia32_vfmaddpd256(a, b, x))
#elif MECHC_HAS_FUSED
#define MECHC_ADD_SUMS(x, a, b) \
    for (int part = 0; part < 4; part++) (x)[part] = __builtin_fma((a)[part], (b)[part], (x)[part])
#else
#define MECHC_ADD_SUMS(x, a, b) ((x) += (a) * (b))
#endif
#define MECHC_SUMS_OF(number) ((number) - (mechc_sums){0})
enum { MECHC_ONCE_INTEGRATED, MECHC_TWICE_INTEGRATED, MECHC_DEGREE_7, MECHC_DEGREE_6 };

/* Larger scenes go over to radau5 where they are stiff. */
#define MECHC_NEWTON_MOST 32
#define MECHC_NEWTON (MECHC_UNKNOWNS <= MECHC_NEWTON_MOST)
#define MECHC_NEWTON_CODE (MECHC_GENERAL || MECHC_UNKNOWNS_MAX <= MECHC_NEWTON_MOST)
#define MECHC_NEWTON_MAX (MECHC_UNKNOWNS_MAX < MECHC_NEWTON_MOST ? MECHC_UNKNOWNS_MAX : MECHC_NEWTON_MOST)
typedef struct mechc_newton mechc_newton;
typedef mechc_sums mechc_modes; /* one number of each pair of eigenvalues */

typedef struct {
    mechc_vector_given given;
    mechc_vector q[MECHC_NQ_MAX][MECHC_BLOCKS];    /* stages as last evaluated */
    mechc_vector turns[MECHC_BLOCKS][MECHC_AT_LEAST_ONE(3 * MECHC_TURNS_MAX)]; /* see sine_cosine.h */
    mechc_vector shift[MECHC_NQ_MAX][MECHC_BLOCKS]; /* changes of q that close their loops */
    mechc_sums columns[MECHC_STAGES];
    double rates[MECHC_UNKNOWNS_MAX][MECHC_STAGES];
    double ends[MECHC_UNKNOWNS_MAX]; /* rates at the last accepted end */
    double least[MECHC_STAGES]; /* conditioning, squared */
    double weights[MECHC_NX_MAX];            /* 1 over what is tolerated */
    double tolerated;                    /* the largest, over the component's scale */
    double error_weights[MECHC_UNKNOWNS_MAX]; /* of the polynomial's last coefficients, squared */
    double error;
    double compensation[MECHC_NX_MAX];        /* of the state, what run->y is too coarse for */
    double next_compensation[MECHC_NX_MAX];
    double lowest;               /* of `least` */
    double left;                 /* gaps that are left, in units of rounding */
#if MECHC_NH_MAX > 0
    const mechc_scalar_given *alone; /* of the run */
    const mechc_critical *crossing;  /* known nearby, or NULL */
    int fine; /* stages near it are closed finely */
#endif
    int closing;                 /* how stages are kept on the constraints */
    int stiff;                   /* steps left to Newton's iteration: the plain one contracts slowly */
    int patience;                /* how many it was given the last time, */
    int plain, slow;             /* steps since; those in a row whose iteration contracted slowly */
    const mechc_newton *newton;  /* of this step; NULL: the plain iteration */
    double response;             /* of stiff components to what the polynomial lacks, at most */
    double shrinking;            /* from the iteration's second change to its third; 0: no third */
    double last_step;            /* 0: no polynomial yet */
    double factor, last_factor;  /* by which this step's error, and the last one's, would have let
                                    it grow; 0: none yet */
    double tried[MECHC_UNKNOWNS_MAX][MECHC_STAGES]; /* rates of the last accepted step */
} mechc_gauss;

MECHC_INLINE void mechc_gauss_sums(const mechc_gauss *g, int unknown, mechc_sums *sums)
{
    const double *x = g->rates[unknown];
    mechc_sums even = g->columns[0] * x[0], odd = g->columns[1] * x[1];
    for (int j = 2; j < MECHC_STAGES; j += 2) {
        MECHC_ADD_SUMS(even, g->columns[j], MECHC_SUMS_OF(x[j]));
        MECHC_ADD_SUMS(odd, g->columns[j + 1], MECHC_SUMS_OF(x[j + 1]));
    }
    *sums = even + odd;
}

/* Stage values of one block before any projection. */
MECHC_INLINE void mechc_gauss_states(const mechc_gauss *g, const double *y, double h,
                                     int block, mechc_vector *state)
{
    mechc_vector first[MECHC_UNKNOWNS_MAX];
    for (int i = 0; i < MECHC_UNKNOWNS; i++)
        first[i] = mechc_take(mechc_gauss_first, block) * g->rates[i][0];
    for (int j = 1; j < MECHC_STAGES; j++) {
        const mechc_vector column = mechc_take(mechc_gauss_first + j * MECHC_STAGES, block);
        for (int i = 0; i < MECHC_UNKNOWNS; i++) MECHC_ADD(first[i], column, mechc_spread(g->rates[i][j]));
    }
    for (int i = 0; i < MECHC_UNKNOWNS; i++)
        state[MECHC_FIRST_UNKNOWN + i] =
            mechc_fused(mechc_spread(h), first[i], mechc_spread(y[MECHC_FIRST_UNKNOWN + i]));
    if (!MECHC_IDENTITY_KINEMATICS) return;
    mechc_vector second[MECHC_NQ_MAX];
    const mechc_vector nodes = h * mechc_take(mechc_gauss_nodes, block);
    for (int i = 0; i < MECHC_NQ; i++)
        second[i] = mechc_take(mechc_gauss_second, block) * g->rates[i][0];
    for (int j = 1; j < MECHC_STAGES; j++) {
        const mechc_vector column = mechc_take(mechc_gauss_second + j * MECHC_STAGES, block);
        for (int i = 0; i < MECHC_NQ; i++) MECHC_ADD(second[i], column, mechc_spread(g->rates[i][j]));
    }
    for (int i = 0; i < MECHC_NQ; i++)
        state[i] = y[i] + mechc_fused(mechc_spread(h * h), second[i], y[MECHC_NQ + i] * nodes);
}

#if MECHC_NH_MAX > 0
/* The gaps of those stages of a block that are near a crossing, beyond the rounding of doubles;
 * zero after these stages are closed. */
MECHC_RARE void mechc_gauss_fine_gaps(const mechc_gauss *g, mechc_vector time, int block,
                                      int closed, const mechc_vector *q, mechc_vector *gaps)
{
#if MECHC_HAS_FINE_GAP
    for (int lane = 0; lane < MECHC_LANES; lane++) {
        double at[MECHC_NQ_MAX], gap[MECHC_NH_MAX] = {0};
        if (!mechc_is_fine(g->least[block * MECHC_LANES + lane])) continue;
        for (int i = 0; i < MECHC_NQ; i++) at[i] = q[i][lane];
        if (!closed) mechc_find_fine_gap(time[lane], at, g->alone, g->crossing, gap);
        for (int i = 0; i < MECHC_NH; i++) gaps[i][lane] = gap[i];
    }
#else
    (void)g, (void)time, (void)block, (void)closed, (void)q, (void)gaps;
#endif
}

/* Correct the stages once towards closed loops; moved: the size of the correction. */
MECHC_INLINE void mechc_gauss_close(mechc_gauss *g, mechc_vector time, int block, int again,
                                    mechc_vector_place *place, mechc_vector *q,
                                    mechc_vector *moved)
{
    for (int i = 0; i < MECHC_NQ; i++) moved[i] = q[i];
    if (g->fine) mechc_gauss_fine_gaps(g, time, block, again, q, place->gap);
    mechc_vector_correct_beyond(time, q, &g->given, place, g->fine ? 0.0 : g->left);
    for (int i = 0; i < MECHC_NQ; i++) {
        moved[i] = q[i] - moved[i];
        g->shift[i][block] += moved[i];
    }
}
#endif

/* Accelerations, and rates of coordinates where these are unknowns. */
MECHC_INLINE void mechc_gauss_rates(const mechc_gauss *g, mechc_vector time,
                                    const mechc_vector *state, const mechc_vector_place *place,
                                    mechc_vector *rates)
{
    mechc_vector_accelerate(time, state, state + MECHC_NQ, &g->given, place,
                            rates + MECHC_UNKNOWNS - MECHC_NU, 0);
    if (!MECHC_IDENTITY_KINEMATICS)
        mechc_vector_coordinate_rates_of(time, state, state + MECHC_NQ, &g->given, rates);
}

/* Rates of one block of stages as they stand; first: before their sines and their conditioning are
 * known. */
MECHC_INLINE void mechc_gauss_unclosed(mechc_gauss *g, double t, double h,
                                       const mechc_vector *state, int block, int first,
                                       mechc_vector *rates)
{
    mechc_vector_place place;
    const mechc_vector time = t + h * mechc_take(mechc_gauss_nodes, block);
    mechc_vector_locate_near(time, state, &g->given, &place, g->turns[block], !first,
                             first ? MECHC_REDUNDANT : 0.0);
    mechc_gauss_rates(g, time, state, &place, rates);
#if MECHC_NH_MAX > 0
    if (!first) return;
    for (int i = 0; i < MECHC_NQ; i++) g->q[i][block] = state[i];
    mechc_put(mechc_vector_conditioning_at(&place), g->least, block);
#endif
}

MECHC_ONCE void mechc_gauss_first_stages(mechc_gauss *g, double t, double h,
                                         const mechc_vector *state, int block,
                                         mechc_vector *rates)
{
    mechc_gauss_unclosed(g, t, h, state, block, 1, rates);
}

MECHC_ONCE void mechc_gauss_plain_stages(mechc_gauss *g, double t, const double *y, double h,
                                         int block, mechc_vector *rates)
{
    mechc_vector state[MECHC_NX_MAX];
    mechc_gauss_states(g, y, h, block, state);
    mechc_gauss_unclosed(g, t, h, state, block, 0, rates);
}

/* Rates of one block of stages at positions and speeds projected; places shift and q. */
MECHC_ONCE void mechc_gauss_stages(mechc_gauss *g, double t, const double *y, double h,
                                   int block, mechc_vector *rates, mechc_vector *moved)
{
    mechc_vector_place place;
    mechc_vector state[MECHC_NX_MAX];
    const mechc_vector time = t + h * mechc_take(mechc_gauss_nodes, block);
    mechc_gauss_states(g, y, h, block, state);
    for (int i = 0; i < MECHC_NQ; i++) state[i] += g->shift[i][block];
    mechc_vector_locate_near(time, state, &g->given, &place, g->turns[block], 0, MECHC_REDUNDANT);
#if MECHC_NH_MAX > 0
    if (g->closing == MECHC_CLOSE_BEFORE) {
        mechc_gauss_close(g, time, block, 0, &place, state, moved);
        mechc_vector_locate(time, state, &g->given, &place);
    }
#endif
    for (int i = 0; i < MECHC_NQ; i++) g->q[i][block] = state[i];
    mechc_vector_steady(&place, state + MECHC_NQ);
    mechc_gauss_rates(g, time, state, &place, rates);
#if MECHC_NH_MAX > 0
    mechc_gauss_close(g, time, block, g->closing == MECHC_CLOSE_BEFORE, &place, state, moved);
    mechc_put(mechc_vector_conditioning_at(&place), g->least, block);
#else
    for (int i = 0; i < MECHC_NQ; i++) moved[i] = mechc_spread(0.0);
#endif
}
