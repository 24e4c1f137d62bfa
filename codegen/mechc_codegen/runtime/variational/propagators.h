/* Propagators of steps by Gauss's collocation, several steps in the lanes: the columns at a step's
 * end are P S + Q along those at its start, whatever these are.
 *
 * The end follows the stages' accelerations by the rows W, and these solve K a = A S + B.  Z = W K^-1
 * is found from the transposed system, which has as many right sides as the state has components.
 */
#pragma once

#include "methods/gauss/stages.h"
#include "variational/collocation.h"

#if MECHC_VARIATIONAL
#define MECHC_NODE_UNKNOWNS (MECHC_STAGES * MECHC_UNKNOWNS)
#define MECHC_NODE_UNKNOWNS_MAX (MECHC_STAGES * MECHC_MOST_PROPAGATED)
#define MECHC_PROPAGATES (MECHC_UNKNOWNS <= MECHC_MOST_PROPAGATED)
#define MECHC_MOST_PROPAGATED 6 /* unknowns: larger matrices leave the cache */
#if MECHC_GENERAL
#define MECHC_PROPAGATES_CODE 1
#else
#define MECHC_PROPAGATES_CODE MECHC_PROPAGATES
#endif

#if MECHC_PROPAGATES_CODE
typedef struct {
    mechc_vector h;
    mechc_vector dense[MECHC_NX_MAX * MECHC_MOST_DENSE], start[MECHC_NX_MAX];
    mechc_vector slopes[MECHC_STAGES][MECHC_NX_MAX * MECHC_SLOPES_MAX];
    mechc_vector matrix[MECHC_NODE_UNKNOWNS_MAX * MECHC_NODE_UNKNOWNS_MAX], inverse[MECHC_NODE_UNKNOWNS_MAX];
    mechc_vector weights[MECHC_NX_MAX * MECHC_NODE_UNKNOWNS_MAX]; /* W, then Z */
    mechc_vector whole[MECHC_NX_MAX * MECHC_SLOPES_MAX], tangent[MECHC_NX_MAX * MECHC_SLOPES_MAX];
} mechc_propagation;

/* Compute the states of stage a, in the lanes. */
MECHC_INLINE void mechc_node_states(const mechc_propagation *g, double s, int rows,
                                    mechc_vector *state)
{
    double weight = 1.0;
    for (int k = 0; k < MECHC_NX; k++) state[k] = g->start[k];
    for (int row = 0; row < rows; row++) {
        weight *= row % 2 ? 1.0 - s : s;
        for (int k = 0; k < MECHC_NX; k++) state[k] += weight * g->dense[row * MECHC_NX + k];
    }
}

/* Where the step of a lane begins and ends; the last step is repeated. */
MECHC_INLINE const double *mechc_times_of(const mechc_steps *steps, int lane)
{
    return steps->record->t + steps->first + (lane < steps->count ? lane : steps->count - 1);
}

MECHC_STATIC void mechc_load_steps(const mechc_steps *steps, mechc_propagation *g)
{
    const mechc_trajectory *record = steps->record;
    const ptrdiff_t first = steps->first;
    const int count = steps->count;
    const int width = MECHC_NX * record->dense_rows;
    double h[MECHC_LANES];
    for (int lane = 0; lane < MECHC_LANES; lane++) {
        const double *times = mechc_times_of(steps, lane);
        h[lane] = times[1] - times[0];
    }
    memcpy(&g->h, h, sizeof h);
    mechc_fill_lanes(record->y + first * MECHC_NX, count, MECHC_NX, g->start);
    mechc_fill_lanes(record->dense + first * width, count, width, g->dense);
}

/* Set times and states of stage a. */
MECHC_INLINE mechc_vector mechc_node_place(const mechc_rule *rule, const mechc_steps *steps, int a,
                                           const mechc_propagation *g, double *t, mechc_vector *state)
{
    mechc_vector time;
    for (int lane = 0; lane < MECHC_LANES; lane++) {
        const double *times = mechc_times_of(steps, lane);
        t[lane] = mechc_within(times[0], times[1], rule->nodes[a]);
    }
    memcpy(&time, t, sizeof time);
    mechc_node_states(g, rule->nodes[a], steps->record->dense_rows, state);
    return time;
}

/* Derivatives of the rates at all stages; either all stages of a step are kept on the constraints
 * or none. */
MECHC_STATIC void mechc_node_slopes(const mechc_rule *rule, const mechc_steps *steps, mechc_propagation *g)
{
    const mechc_given_twice *given = steps->given;
    mechc_vector state[MECHC_NX_MAX], rates[MECHC_NX_MAX];
    mechc_mask kept = {0};
    double t[MECHC_LANES];
    for (int a = 0; MECHC_NC > 0 && a < MECHC_STAGES; a++) {
        const mechc_vector time = mechc_node_place(rule, steps, a, g, t, state);
        kept |= mechc_keeps(MECHC_GAUSS8, state, time, given);
    }
    for (int a = 0; a < MECHC_STAGES; a++) {
        const mechc_vector time = mechc_node_place(rule, steps, a, g, t, state);
        if (mechc_any(kept)) mechc_keep_lanes(given, t, steps->count, kept, state);
        mechc_vector_linearise(time, state, &given->vector, kept, rates, g->slopes[a]);
    }
}

/* Set up K and W: unknown i of stage a has the place a MECHC_UNKNOWNS + i. */
MECHC_STATIC void mechc_node_matrix(const mechc_rule *rule, mechc_propagation *g)
{
    const int n = MECHC_NODE_UNKNOWNS, m = MECHC_UNKNOWNS, nq = MECHC_FIRST_UNKNOWN;
    for (int a = 0; a < MECHC_STAGES; a++)
        for (int b = 0; b < MECHC_STAGES; b++) {
            const mechc_vector once = g->h * rule->first[a][b];
            const mechc_vector twice = g->h * g->h * rule->second[a][b];
            for (int i = 0; i < m; i++) {
                const mechc_vector *row = g->slopes[a] + (nq + i) * MECHC_SLOPES;
                mechc_vector *to = g->matrix + (a * m + i) * n + b * m;
                for (int k = 0; k < m; k++) {
                    to[k] = -once * row[nq + k];
                    if (k < nq) to[k] -= twice * row[k];
                    if (a == b && i == k) to[k] += 1.0;
                }
            }
        }
    for (int k = 0; k < MECHC_NX * n; k++) g->weights[k] = mechc_spread(0.0);
    for (int b = 0; b < MECHC_STAGES; b++)
        for (int i = 0; i < m; i++) {
            g->weights[(nq + i) * n + b * m + i] = g->h * rule->first[MECHC_STAGES][b];
            if (nq) g->weights[i * n + b * m + i] = g->h * g->h * rule->second[MECHC_STAGES][b];
        }
}

/* Eliminate with rows j and j + 1 from the rows below: two pivots share each load. */
MECHC_INLINE mechc_vector mechc_factor_pair(mechc_propagation *g, int j, mechc_vector growth)
{
    const int n = MECHC_NODE_UNKNOWNS;
    mechc_vector *first = g->matrix + j * n, *second = first + n;
    g->inverse[j] = 1.0 / first[j];
    second[j] *= g->inverse[j];
    for (int k = j + 1; k < n; k++) MECHC_SUB(second[k], second[j], first[k]);
    g->inverse[j + 1] = 1.0 / second[j + 1];
    growth = mechc_larger(growth, second[j]);
    for (int i = j + 2; i < n; i++) {
        mechc_vector *below = g->matrix + i * n;
        const mechc_vector one = below[j] * g->inverse[j];
        const mechc_vector two = mechc_fused_off(one, first[j + 1], below[j + 1]) * g->inverse[j + 1];
        growth = mechc_larger(mechc_larger(growth, one), two);
        below[j] = one, below[j + 1] = two;
        for (int k = j + 2; k < n; k++)
            below[k] = mechc_fused_off(two, second[k], mechc_fused_off(one, first[k], below[k]));
    }
    return growth;
}

/* Apply a row of the factors to all right sides: z_k <- z_k - z_j entry_k. */
MECHC_INLINE void mechc_take_factor_row(mechc_propagation *g, int j, int first, int last)
{
    const int n = MECHC_NODE_UNKNOWNS;
    const mechc_vector *row = g->matrix + j * n;
    mechc_vector z[MECHC_NX_MAX];
    for (int r = 0; r < MECHC_NX; r++) z[r] = g->weights[r * n + j];
    for (int k = first; k < last; k++) {
        const mechc_vector entry = row[k];
        for (int r = 0; r < MECHC_NX; r++) MECHC_SUB(g->weights[r * n + k], z[r], entry);
    }
}

/* Compute Z = W U^-1 L^-1 in the place of W. */
MECHC_STATIC void mechc_weigh_nodes(mechc_propagation *g)
{
    const int n = MECHC_NODE_UNKNOWNS;
    for (int j = 0; j < n; j++) {
        for (int r = 0; r < MECHC_NX; r++) g->weights[r * n + j] *= g->inverse[j];
        mechc_take_factor_row(g, j, j + 1, n);
    }
    for (int j = n - 1; j > 0; j--) mechc_take_factor_row(g, j, 0, j);
}

/* Add column k of the rates of all stages through Z; drift: weighted by the time since the start. */
MECHC_INLINE void mechc_through_nodes(const mechc_rule *rule, const mechc_propagation *g, int k,
                                      int drift, mechc_vector *sum)
{
    const int m = MECHC_UNKNOWNS, nq = MECHC_FIRST_UNKNOWN;
    for (int a = 0; a < MECHC_STAGES; a++)
        for (int i = 0; i < m; i++) {
            mechc_vector slope = g->slopes[a][(nq + i) * MECHC_SLOPES + k];
            if (drift) slope *= g->h * rule->nodes[a];
            for (int r = 0; r < MECHC_NX; r++)
                MECHC_ADD(sum[r], g->weights[r * MECHC_NODE_UNKNOWNS + a * m + i], slope);
        }
}

/* Compute the propagators before the projection of the ends. */
MECHC_STATIC void mechc_combine_nodes(const mechc_rule *rule, mechc_propagation *g)
{
    const int nq = MECHC_FIRST_UNKNOWN;
    for (int k = 0; k < MECHC_SLOPES; k++) {
        mechc_vector sum[MECHC_NX_MAX];
        for (int r = 0; r < MECHC_NX; r++) sum[r] = mechc_spread(k == r ? 1.0 : 0.0);
        if (nq && k >= nq && k < MECHC_NX) {
            sum[k - nq] += g->h;
            mechc_through_nodes(rule, g, k - nq, 1, sum);
        }
        mechc_through_nodes(rule, g, k, 0, sum);
        for (int r = 0; r < MECHC_NX; r++) g->whole[r * MECHC_SLOPES + k] = sum[r];
    }
}

/* Compute the propagators to the projected ends. */
MECHC_STATIC void mechc_project_nodes(mechc_propagation *g)
{
    for (int k = 0; k < MECHC_SLOPES; k++) {
        mechc_vector sum[MECHC_NX_MAX];
        for (int r = 0; r < MECHC_NX; r++)
            sum[r] = k < MECHC_NX ? mechc_spread(0.0) : g->tangent[r * MECHC_SLOPES + k];
        for (int i = 0; i < MECHC_NX; i++)
            for (int r = 0; r < MECHC_NX; r++)
                MECHC_ADD(sum[r], g->tangent[r * MECHC_SLOPES + i], g->whole[i * MECHC_SLOPES + k]);
        for (int r = 0; r < MECHC_NX; r++) g->whole[r * MECHC_SLOPES + k] = sum[r];
    }
}

/* Propagators of the steps, NX rows of MECHC_SLOPES; 0 if the elimination needs exchanges of rows. */
MECHC_ONCE int mechc_propagate(const mechc_rule *rule, const mechc_steps *steps, mechc_propagation *g)
{
    mechc_load_steps(steps, g);
    mechc_node_slopes(rule, steps, g);
    mechc_node_matrix(rule, g);
    mechc_vector growth = mechc_spread(0.0);
    for (int j = 0; j < MECHC_NODE_UNKNOWNS; j += 2) growth = mechc_factor_pair(g, j, growth);
    if (!(mechc_greatest(growth) <= MECHC_GROWTH)) return 0;
    mechc_weigh_nodes(g);
    mechc_combine_nodes(rule, g);
#if MECHC_NC_MAX > 0
    double ends[MECHC_LANES];
    mechc_tangents_in_lanes(steps, ends, g->tangent);
    mechc_project_nodes(g);
#endif
    return 1;
}
#endif
#endif
