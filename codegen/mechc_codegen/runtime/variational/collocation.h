/* The variational equations S' = A S + B over a step by collocation, on the nodes of the motion.
 *
 * The equations are linear, so the stages are solved for directly, all columns at once; where
 * q' = u the accelerations' columns are the only unknowns, as in the motion's own iteration.
 */
#pragma once

#include "methods/gauss/tableau.h"
#include "methods/radau_tableau.h"
#include "run/dense_output.h"
#include "variational/columns.h"

#if MECHC_VARIATIONAL
#define MECHC_VARIED_NODES 8
/* Factors of an elimination without exchanges of rows beyond which it is done again with them. */
#define MECHC_GROWTH 1e3

/* Integrals of the rates, and second integrals, to each node and to the end. */
typedef struct {
    int stages;
    double nodes[MECHC_VARIED_NODES + 1];
    double first[MECHC_VARIED_NODES + 1][MECHC_VARIED_NODES];
    double second[MECHC_VARIED_NODES + 1][MECHC_VARIED_NODES];
} mechc_rule;

#define MECHC_RULE_OF(name, NUMBER, number, PART, degree, RULE, ...) MECHC_RULE_##RULE,

/* The rule by which derivatives follow the steps of a method. */
MECHC_INLINE mechc_derivative_rule mechc_rule_of(int method)
{
    static const mechc_derivative_rule rules[] = {MECHC_METHOD_TABLE(MECHC_RULE_OF)};
    return rules[method];
}

MECHC_STATIC void mechc_gauss_rule(mechc_rule *rule)
{
    rule->stages = MECHC_STAGES;
    for (int a = 0; a <= MECHC_STAGES; a++) {
        rule->nodes[a] = mechc_gauss_nodes[a];
        for (int b = 0; b < MECHC_STAGES; b++) {
            const int end = a == MECHC_STAGES, entry = b * MECHC_STAGES + a;
            rule->first[a][b] = end ? mechc_gauss_weights[b] : mechc_gauss_first[entry];
            rule->second[a][b] = end ? mechc_gauss_second_weights[b] : mechc_gauss_second[entry];
        }
    }
}

/* The rule of Radau's method, whose last node is the step's end. */
MECHC_STATIC void mechc_radau_rule(mechc_rule *rule)
{
    rule->stages = MECHC_RADAU_STAGES;
    for (int a = 0; a <= MECHC_RADAU_STAGES; a++) {
        const int row = a < MECHC_RADAU_STAGES ? a + 1 : MECHC_RADAU_STAGES;
        rule->nodes[a] = mechc_radau5_nodes[row];
        for (int b = 0; b < MECHC_RADAU_STAGES; b++)
            rule->first[a][b] = mechc_radau5_matrix[row][b + 1];
    }
    for (int a = 0; a <= MECHC_RADAU_STAGES; a++) /* as its stages, first order in q too */
        for (int b = 0; b < MECHC_RADAU_STAGES; b++) {
            rule->second[a][b] = 0.0;
            for (int m = 0; m < MECHC_RADAU_STAGES; m++)
                rule->second[a][b] += rule->first[a][m] * rule->first[m][b];
        }
}

/* Derivatives at the stages of one step, one block for each. */
typedef struct {
    double t[MECHC_VARIED_NODES], y[MECHC_VARIED_NODES * MECHC_NX_MAX];
    int kept;
    double *slopes;
} mechc_nodes_at_hand;

/* Times and states of the stages, which lie on the dense output. */
MECHC_STATIC void mechc_place_nodes(int method, const mechc_rule *rule,
                                    const mechc_trajectory *record, ptrdiff_t step,
                                    const mechc_given_twice *given, mechc_nodes_at_hand *nodes)
{
    const double *t = record->t + step, *y = record->y + step * MECHC_NX;
    const double *rows = record->dense + step * MECHC_NX * record->dense_rows;
    for (int a = 0; a < rule->stages; a++) {
        nodes->t[a] = mechc_within(t[0], t[1], rule->nodes[a]);
        mechc_dense_polynomial(y, rows, record->dense_rows, rule->nodes[a],
                               nodes->y + a * MECHC_NX);
    }
    mechc_mask along = {0};
    for (int a = 0; a < rule->stages; a += MECHC_LANES) {
        const int left = rule->stages - a, count = left < MECHC_LANES ? left : MECHC_LANES;
        along |= mechc_kept_states(method, given, count, nodes->t + a, nodes->y + a * MECHC_NX);
    }
    nodes->kept = mechc_any(along);
}

/* Derivatives of the rates at the placed stages; either all stages are kept on the constraints or none. */
MECHC_ONCE void mechc_linearise_nodes(const mechc_rule *rule, const mechc_given_twice *given,
                                      const mechc_directions *d, mechc_nodes_at_hand *nodes)
{
    const mechc_mask along = nodes->kept ? ~(mechc_mask){0} : (mechc_mask){0};
    for (int a = 0; a < rule->stages; a += MECHC_LANES) {
        const int left = rule->stages - a, count = left < MECHC_LANES ? left : MECHC_LANES;
        mechc_linearise_states(along, given, count, nodes->t + a, nodes->y + a * MECHC_NX, d,
                               0, nodes->slopes + a * d->block);
    }
}

/* y <- y - factor x, from vector `first` on */
MECHC_INLINE void mechc_take_row(double factor, const mechc_vector *x, int first, int width,
                                 mechc_vector *y)
{
    for (int v = first; v < width; v++) MECHC_SUB(y[v], mechc_spread(factor), x[v]);
}

MECHC_INLINE double mechc_entry(const mechc_vector *row, int j)
{
    return ((const double *)row)[j];
}

/* Solve the rows [matrix | right sides], the matrix in `own` vectors; the solution takes the place
 * of the right sides.  0 where a factor is large, or with exchanges where a pivot vanishes. */
MECHC_INLINE int mechc_eliminate(mechc_vector **rows, int size, int own, int width, int exchange)
{
    double growth = 0.0;
    for (int j = 0; j < size; j++) {
        int best = j;
        for (int i = j + 1; exchange && i < size; i++)
            if (fabs(mechc_entry(rows[i], j)) > fabs(mechc_entry(rows[best], j))) best = i;
        mechc_vector *const row = rows[best];
        rows[best] = rows[j], rows[j] = row;
        const double pivot = mechc_entry(row, j), inverse = 1.0 / pivot;
        if (exchange && !(fabs(pivot) > 0.0)) return 0;
        for (int i = j + 1; i < size; i++) {
            const double factor = mechc_entry(rows[i], j) * inverse;
            growth = mechc_max(growth, fabs(factor));
            mechc_take_row(factor, row, j / MECHC_LANES, width, rows[i]);
        }
    }
    for (int j = size - 1; j >= 0; j--) {
        const double inverse = 1.0 / mechc_entry(rows[j], j);
        for (int v = own; v < width; v++) rows[j][v] *= inverse;
        for (int i = 0; i < j; i++)
            mechc_take_row(mechc_entry(rows[i], j), rows[j], own, width, rows[i]);
    }
    return exchange || growth <= MECHC_GROWTH;
}

/* The linear equations of one step: unknown are the rates at its stages from component nq on, `size` of each;
 * nq: coordinates where q' = u is integrated twice, else 0. */
typedef struct {
    const mechc_rule *rule;
    const mechc_nodes_at_hand *nodes;
    const mechc_directions *d;
    double h;
    int stages, nq, size, width;
} mechc_step_equations;

MECHC_INLINE void mechc_stage_equations(const mechc_step_equations *e, const mechc_vector *start, int own,
                                        mechc_vector *room, mechc_vector **rows)
{
    const mechc_rule *rule = e->rule;
    const int nq = e->nq, size = e->size, width = e->width, stride = own + width;
    const double h = e->h;
    for (int a = 0; a < e->stages; a++)
        for (int i = 0; i < size; i++) {
            const double *block = e->nodes->slopes + a * e->d->block;
            const double *slopes = block + (nq + i) * MECHC_NX;
            mechc_vector *row = rows[a * size + i] = room + (a * size + i) * stride;
            double *entries = (double *)row;
            row[own - 1] = mechc_spread(0.0);
            for (int b = 0; b < e->stages; b++) {
                const double once = h * rule->first[a][b], twice = h * h * rule->second[a][b];
                for (int k = 0; k < size; k++)
                    entries[b * size + k] =
                        -once * slopes[nq + k] - (k < nq ? twice * slopes[k] : 0.0);
            }
            entries[a * size + i] += 1.0;
            for (int v = 0; v < width; v++) {
                mechc_vector sum = mechc_row_along(block, nq + i, width, v, start + v, width);
                for (int k = 0; k < nq; k++)
                    sum += h * rule->nodes[a] * slopes[k] * start[(nq + k) * width + v];
                row[own + v] = sum;
            }
        }
}

/* Columns at node a (the end: a = stages) from the rates of the stages, a vector of them. */
MECHC_INLINE void mechc_node_columns(const mechc_step_equations *e, int a, const mechc_vector *start,
                                     mechc_vector *const *rows, int place, mechc_vector *columns)
{
    const mechc_rule *rule = e->rule;
    const int nq = e->nq, size = e->size, width = e->width;
    const double h = e->h;
    for (int k = 0; k < MECHC_NX; k++) columns[k] = start[k * width];
    for (int k = 0; k < nq; k++) columns[k] += h * rule->nodes[a] * start[(nq + k) * width];
    for (int b = 0; b < e->stages; b++) {
        const double once = h * rule->first[a][b], twice = h * h * rule->second[a][b];
        for (int k = 0; k < size; k++)
            MECHC_ADD(columns[nq + k], mechc_spread(once), rows[b * size + k][place]);
        for (int k = 0; k < nq; k++) MECHC_ADD(columns[k], mechc_spread(twice), rows[b * size + k][place]);
    }
}

/* Set up and solve the equations; 0 if they are singular. */
MECHC_INLINE int mechc_solve_nodes(const mechc_step_equations *e, const mechc_vector *start, int own,
                                   mechc_vector *room, mechc_vector **rows)
{
    const int size = e->stages * e->size;
    mechc_stage_equations(e, start, own, room, rows);
    if (e->stages == MECHC_STAGES && mechc_eliminate(rows, size, own, own + e->width, 0)) return 1;
    mechc_stage_equations(e, start, own, room, rows);
    return mechc_eliminate(rows, size, own, own + e->width, 1);
}

/* One step: start and end are (NX, width) vectors; rates: S' at the stages, or NULL. */
MECHC_INLINE int mechc_collocate_as(const mechc_step_equations *e, const double *tangent,
                                    const mechc_vector *start, mechc_vector *room, mechc_vector **rows,
                                    mechc_vector *end, double *rates)
{
    const int nq = e->nq, size = e->size, width = e->width, columns = e->d->columns;
    const int own = (e->stages * size + MECHC_LANES - 1) / MECHC_LANES;
    const int whole = mechc_solve_nodes(e, start, own, room, rows);
    for (int v = 0; v < width; v++) {
        mechc_vector at[MECHC_NX_MAX];
        const int left = columns - v * MECHC_LANES, some = left < MECHC_LANES ? left : MECHC_LANES;
        for (int a = 0; rates && a < e->stages; a++) {
            double *to = rates + a * MECHC_NX * columns + v * MECHC_LANES;
            if (nq) mechc_node_columns(e, a, start + v, rows, own + v, at);
            for (int k = 0; k < nq; k++) mechc_unpad(at + nq + k, some, to + k * columns);
            for (int k = 0; k < size; k++)
                mechc_unpad(rows[a * size + k] + own + v, some, to + (nq + k) * columns);
        }
        mechc_node_columns(e, e->stages, start + v, rows, own + v, at);
        mechc_onto_tangent(tangent, width, v, at);
        for (int k = 0; k < MECHC_NX; k++) end[k * width + v] = at[k];
    }
    return whole;
}

/* Sizes that are usual are constants. */
#define MECHC_COLLOCATE(name, stages, nq, width)                                                  \
    MECHC_ONCE int name(const mechc_step_equations *of, const double *tangent,                    \
                        const mechc_vector *start, mechc_vector *room, mechc_vector **rows,       \
                        mechc_vector *end, double *rates)                                         \
    {                                                                                             \
        const mechc_step_equations e = {of->rule, of->nodes,      of->d, of->h,                   \
                                        stages,   nq, MECHC_NX - (nq), width};                    \
        return mechc_collocate_as(&e, tangent, start, room, rows, end, rates);                    \
    }
MECHC_COLLOCATE(mechc_collocate_any, of->rule->stages, 0, of->d->width)
#if MECHC_GENERAL || !MECHC_KINEMATICS_CODE
MECHC_COLLOCATE(mechc_collocate_twice, of->rule->stages, MECHC_NQ, of->d->width)
#if MECHC_NU_MAX * MECHC_LANES <= 64
MECHC_COLLOCATE(mechc_collocate_1, MECHC_STAGES, MECHC_NQ, 1)
MECHC_COLLOCATE(mechc_collocate_2, MECHC_STAGES, MECHC_NQ, 2)
#endif
#endif
#undef MECHC_COLLOCATE

/* Whether accelerations are integrated twice: by Gauss's stages, projected afterwards, not by
 * Radau's. */
MECHC_INLINE int mechc_integrates_twice(const mechc_rule *rule, int kept)
{
    return MECHC_IDENTITY_KINEMATICS && (rule->stages == MECHC_STAGES || !kept);
}

MECHC_STATIC int mechc_collocate(const mechc_step_equations *of, const double *tangent,
                                 const mechc_vector *start, mechc_vector *room, mechc_vector **rows,
                                 mechc_vector *end, double *rates)
{
#if MECHC_GENERAL || !MECHC_KINEMATICS_CODE
#if MECHC_NU_MAX * MECHC_LANES <= 64
    const int gauss = MECHC_IDENTITY_KINEMATICS && of->rule->stages == MECHC_STAGES;
    if (gauss && of->d->width == 1)
        return mechc_collocate_1(of, tangent, start, room, rows, end, rates);
    if (gauss && of->d->width == 2)
        return mechc_collocate_2(of, tangent, start, room, rows, end, rates);
#endif
    if (mechc_integrates_twice(of->rule, of->nodes->kept))
        return mechc_collocate_twice(of, tangent, start, room, rows, end, rates);
#endif
    return mechc_collocate_any(of, tangent, start, room, rows, end, rates);
}
#endif
