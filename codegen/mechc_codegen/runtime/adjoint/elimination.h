/* A step by collocation, backwards, by elimination: for stiff steps, and where the iteration of
 * gauss.h does not converge.  The transposed equations of its stages are formed from Jacobians.
 */
#pragma once

#include "adjoint/covector.h"

#if MECHC_VARIATIONAL
/* The equations K^T z = w; unknown i of stage a has the place a size + i. */
typedef struct {
    mechc_step_equations step;
    double w[MECHC_VARIED_NODES * MECHC_NX_MAX], z[MECHC_VARIED_NODES * MECHC_NX_MAX];
} mechc_eliminated;

/* Allocate work space with a column for each parameter and input, and for those of the shapes. */
MECHC_STATIC mechc_varying *mechc_new_blocks(const mechc_covariation *v)
{
    double *unit = calloc((size_t)(MECHC_NB * v->columns + 1), sizeof *unit);
    if (!unit) return 0;
    for (int i = 0; i < MECHC_NB; i++) unit[i * (v->columns + 1)] = 1.0;
    mechc_varying *blocks =
        mechc_new_varying(v->trajectory, v->p, v->inputs, unit, v->columns, v->shapes);
    free(unit);
    return blocks;
}

MECHC_INLINE const double *mechc_block_of(const mechc_eliminated *c, int a)
{
    return c->step.nodes->slopes + a * c->step.d->block;
}

/* Form row b size + k of the matrix, and its right side in the vector behind it. */
MECHC_INLINE void mechc_transposed_row(const mechc_eliminated *c, int b, int k, int own,
                                       mechc_vector *row)
{
    double *entries = (double *)row;
    row[own - 1] = row[own] = mechc_spread(0.0);
    for (int a = 0; a < c->step.rule->stages; a++)
        for (int i = 0; i < c->step.size; i++) {
            const double *slopes = mechc_block_of(c, a) + (c->step.nq + i) * MECHC_NX;
            const double twice = k < c->step.nq ? c->step.rule->second[a][b] * slopes[k] : 0.0;
            entries[a * c->step.size + i] =
                -c->step.h * (c->step.rule->first[a][b] * slopes[c->step.nq + k] + c->step.h * twice);
        }
    entries[b * c->step.size + k] += 1.0;
    row[own][0] = c->w[b * c->step.size + k];
}

MECHC_STATIC int mechc_solve_transposed(mechc_eliminated *c, mechc_vector *room,
                                        mechc_vector **rows)
{
    const int count = c->step.rule->stages * c->step.size;
    const int own = (count + MECHC_LANES - 1) / MECHC_LANES;
    for (int n = 0; n < count; n++) {
        rows[n] = room + n * (own + 1);
        mechc_transposed_row(c, n / c->step.size, n % c->step.size, own, rows[n]);
    }
    if (!mechc_eliminate(rows, count, own, own + 1, 1)) return 0;
    for (int k = 0; k < count; k++) c->z[k] = rows[k][own][0];
    return 1;
}

MECHC_INLINE void mechc_weigh_end(mechc_eliminated *c, const double *covector)
{
    const mechc_rule *rule = c->step.rule;
    const int end = rule->stages;
    for (int b = 0; b < rule->stages; b++)
        for (int k = 0; k < c->step.size; k++) {
            const double twice = k < c->step.nq ? c->step.h * rule->second[end][b] * covector[k] : 0.0;
            c->w[b * c->step.size + k] = c->step.h * (rule->first[end][b] * covector[c->step.nq + k] + twice);
        }
}

/* Go back over one step whose nodes are placed; 0 if its equations are singular. */
MECHC_STATIC int mechc_eliminated_back(mechc_varying *blocks, const mechc_rule *rule, double h,
                                       double *covector, double *gradient)
{
    const mechc_directions *d = &blocks->directions;
    mechc_nodes_at_hand *const nodes = &blocks->nodes;
    const int nq = mechc_integrates_twice(rule, nodes->kept) ? MECHC_NQ : 0, size = MECHC_NX - nq;
    mechc_eliminated c = {{rule, nodes, d, h, rule->stages, nq, size, d->width}, {0}, {0}};
    mechc_linearise_nodes(rule, &blocks->given, d, nodes);
    mechc_weigh_end(&c, covector);
    if (!mechc_solve_transposed(&c, blocks->room, blocks->rows)) return 0;
    for (int k = 0; k < nq; k++) covector[nq + k] += h * covector[k];
    for (int a = 0; a < rule->stages; a++) {
        double by_state[MECHC_NX_MAX] = {0.0};
        const double *z = c.z + a * size, *rows = mechc_block_of(&c, a) + nq * MECHC_NX;
        const double *given = mechc_block_of(&c, a) + MECHC_BY_STATE + nq * d->width * MECHC_LANES;
        for (int i = 0; i < size; i++)
            for (int k = 0; k < MECHC_NX; k++) by_state[k] += z[i] * rows[i * MECHC_NX + k];
        for (int k = 0; k < MECHC_NX; k++) covector[k] += by_state[k];
        for (int k = 0; k < nq; k++) covector[nq + k] += h * rule->nodes[a] * by_state[k];
        for (int i = 0; i < size; i++)
            for (int k = 0; k < d->columns; k++)
                gradient[k] += z[i] * given[i * d->width * MECHC_LANES + k];
    }
    return 1;
}
#endif
