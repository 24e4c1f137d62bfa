/* A step by Gauss's collocation, backwards, its stages in the lanes.
 *
 * The transposed equations of the stages, z = w + E^T z where the stages' own matrix is I - E, are
 * iterated as the stages' own are; E^T z is made of covectors pulled back at the stages.
 */
#pragma once

#include "adjoint/covector.h"

#if MECHC_VARIATIONAL
#define MECHC_COSTAGE_EXACT 1e-16 /* of the largest: changes that are none, */
#define MECHC_COSTAGE_ROUNDING 1e-14 /* and that are rounding once they no longer fall */
#define MECHC_ADJOINT_ITERATIONS 40

/* z: of the unknown rates, those before MECHC_FIRST_UNKNOWN are 0. */
typedef struct {
    const mechc_rule *rule;
    double h;
    mechc_vector w[MECHC_BLOCKS][MECHC_NX_MAX], z[MECHC_BLOCKS][MECHC_NX_MAX];
    mechc_vector slopes[MECHC_BLOCKS][MECHC_SLOPES_MAX];
} mechc_costages;

/* Solve the motion at the stages of a step. */
MECHC_STATIC void mechc_take_costages(mechc_covarying *w, const mechc_nodes_at_hand *nodes)
{
    for (int block = 0; block < MECHC_BLOCKS; block++) {
        const double *t = nodes->t + block * MECHC_LANES;
        mechc_vector time, state[MECHC_NX_MAX], rates[MECHC_NX_MAX];
        mechc_mask kept = {0};
        mechc_fill_lanes(t, MECHC_LANES, 1, &time);
        mechc_fill_lanes(nodes->y + block * MECHC_LANES * MECHC_NX, MECHC_LANES, MECHC_NX, state);
        if (nodes->kept) mechc_keep_lanes(&w->given, t, MECHC_LANES, kept = ~kept, state);
        mechc_vector_solve_state(time, state, &w->given.vector, &w->lanes[block], rates);
        mechc_vector_prepare_pullback(&w->given.vector, kept, &w->lanes[block]);
    }
}

MECHC_INLINE void mechc_begin_costages(mechc_costages *c, const double *covector)
{
    const int nq = MECHC_FIRST_UNKNOWN;
    for (int block = 0; block < MECHC_BLOCKS; block++) {
        const mechc_vector once = c->h * mechc_take(c->rule->first[MECHC_STAGES], block);
        const mechc_vector twice =
            c->h * c->h * mechc_take(c->rule->second[MECHC_STAGES], block);
        for (int k = 0; k < nq; k++) c->w[block][k] = mechc_spread(0.0);
        for (int k = 0; k < MECHC_UNKNOWNS; k++) {
            c->w[block][nq + k] = once * covector[nq + k];
            if (k < nq) c->w[block][nq + k] += twice * covector[k];
        }
    }
    memcpy(c->z, c->w, sizeof c->z);
}

/* Compute the next z of a component. */
MECHC_INLINE void mechc_next_costages(const mechc_costages *c, int k, mechc_vector *next)
{
    const int nq = MECHC_FIRST_UNKNOWN;
    for (int block = 0; block < MECHC_BLOCKS; block++) next[block] = c->w[block][nq + k];
    for (int a = 0; a < MECHC_STAGES; a++) {
        const mechc_vector *slopes = c->slopes[a / MECHC_LANES];
        const double once = c->h * slopes[nq + k][a % MECHC_LANES];
        const double twice = k < nq ? c->h * c->h * slopes[k][a % MECHC_LANES] : 0.0;
        for (int block = 0; block < MECHC_BLOCKS; block++) {
            MECHC_ADD(next[block], mechc_spread(once), mechc_take(c->rule->first[a], block));
            if (k < nq) MECHC_ADD(next[block], mechc_spread(twice), mechc_take(c->rule->second[a], block));
        }
    }
}

/* One iteration z <- w + E^T z; returns the largest change. */
MECHC_STATIC double mechc_iterate_costages(const mechc_covarying *w, mechc_costages *c)
{
    mechc_vector change = mechc_spread(0.0);
    for (int block = 0; block < MECHC_BLOCKS; block++)
        mechc_vector_pull_back(&w->lanes[block], &w->given.vector, c->z[block], c->slopes[block]);
    for (int k = 0; k < MECHC_UNKNOWNS; k++) {
        mechc_vector next[MECHC_BLOCKS];
        mechc_next_costages(c, k, next);
        for (int block = 0; block < MECHC_BLOCKS; block++) {
            mechc_vector *z = &c->z[block][MECHC_FIRST_UNKNOWN + k];
            change = mechc_larger(change, next[block] - *z);
            *z = next[block];
        }
    }
    return mechc_greatest(change);
}

/* Iterate down to rounding, with the slopes of the last z but one, which is as near; 0 without
 * convergence. */
MECHC_STATIC int mechc_converge_costages(const mechc_covarying *w, mechc_costages *c)
{
    mechc_vector sizes = mechc_spread(0.0);
    double before = HUGE_VAL;
    for (int block = 0; block < MECHC_BLOCKS; block++)
        for (int k = 0; k < MECHC_NX; k++) sizes = mechc_larger(sizes, c->w[block][k]);
    const double largest = mechc_greatest(sizes);
    for (int iteration = 0; iteration < MECHC_ADJOINT_ITERATIONS; iteration++) {
        const double change = mechc_iterate_costages(w, c);
        if (change <= MECHC_COSTAGE_EXACT * largest
            || (change >= before && change <= MECHC_COSTAGE_ROUNDING * largest))
            return 1;
        if (!(change < HUGE_VAL) || (iteration > 3 && change > 2.0 * before)) return 0;
        before = change;
    }
    return 0;
}

/* Gather derivatives by shapes, whose factors differ from stage to stage. */
MECHC_STATIC void mechc_gather_stages(const mechc_covariation *v, const double *t,
                                      const mechc_vector *slopes)
{
    for (int lane = 0; v->shapes && lane < MECHC_LANES; lane++) {
        double one[MECHC_AT_LEAST_ONE(MECHC_NB_MAX)];
        for (int k = 0; k < MECHC_NB; k++) one[k] = slopes[k][lane];
        mechc_gather_shapes(v, t[lane], one);
    }
}

/* Go back over one step; 0 without convergence, with the covector unchanged. */
MECHC_STATIC int mechc_gauss_back(mechc_covarying *w, const mechc_covariation *v,
                                  const mechc_nodes_at_hand *nodes, double h)
{
    const mechc_rule *rule = &w->rules[MECHC_RULE_GAUSS];
    double *const covector = v->covector;
    const int nq = MECHC_FIRST_UNKNOWN;
    mechc_costages c = {.rule = rule, .h = h};
    mechc_begin_costages(&c, covector);
    mechc_take_costages(w, nodes);
    if (!mechc_converge_costages(w, &c)) return 0;
    for (int k = 0; k < nq; k++) covector[nq + k] += h * covector[k];
    for (int k = 0; k < MECHC_NX; k++) {
        mechc_vector once[MECHC_BLOCKS], twice[MECHC_BLOCKS];
        for (int block = 0; block < MECHC_BLOCKS; block++) {
            once[block] = c.slopes[block][k];
            twice[block] = h * mechc_take(rule->nodes, block) * once[block];
        }
        covector[k] += mechc_sum_of_parts(once);
        if (k < nq) covector[nq + k] += mechc_sum_of_parts(twice);
    }
    for (int block = 0; block < MECHC_BLOCKS; block++) {
        const mechc_vector *slopes = c.slopes[block] + MECHC_NX;
        for (int k = 0; k < MECHC_NB; k++) w->gathered[k][block] += slopes[k];
        mechc_gather_stages(v, nodes->t + block * MECHC_LANES, slopes);
    }
    return 1;
}
#endif
