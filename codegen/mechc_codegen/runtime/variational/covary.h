/* Covectors backwards over the steps of a run: the adjoint of the steps as they were taken, which is
 * the transposed of vary.h, operation by operation.
 *
 * Its cost does not grow with the number of parameters but by their derivatives of the rates.
 * Sanz-Serna (2016), SIAM Review 58.
 */
#pragma once

#include "variational/vary.h"

#if MECHC_VARIATIONAL
#define MECHC_ADJOINT_ITERATIONS 40

/* to <- to + sum_i z_i row_i, of `count` rows from row `first` of a block: by the state, and by
 * parameters and inputs. */
MECHC_INLINE void mechc_by_state(const double *block, int first, int count, const double *z,
                                 double *to)
{
    for (int i = 0; i < count; i++)
        for (int k = 0; k < MECHC_NX; k++) to[k] += z[i] * block[(first + i) * MECHC_NX + k];
}

MECHC_INLINE void mechc_by_given(const double *block, int first, int count, const double *z,
                                 const mechc_directions *d, double *to)
{
    const double *rows = block + MECHC_SQUARE + first * d->width * MECHC_LANES;
    for (int i = 0; i < count; i++)
        for (int k = 0; k < d->columns; k++) to[k] += z[i] * rows[i * d->width * MECHC_LANES + k];
}

/* From behind the projection of a step's end to before it. */
MECHC_STATIC void mechc_before_projection(const double *tangent, const mechc_directions *d,
                                          double *covector, double *gradient)
{
#if MECHC_NC > 0
    double after[MECHC_NX];
    memcpy(after, covector, sizeof after);
    memset(covector, 0, sizeof after);
    mechc_by_state(tangent, 0, MECHC_NX, after, covector);
    mechc_by_given(tangent, 0, MECHC_NX, after, d, gradient);
#else
    (void)tangent, (void)d, (void)covector, (void)gradient;
#endif
}

/* Step n of those at hand, by an explicit pair. */
MECHC_STATIC void mechc_pair_back(const mechc_tableau *tableau, const mechc_pair_stages *stages,
                                  int n, double h, const mechc_directions *d, double *covector,
                                  double *gradient)
{
    const int count = tableau->stages;
    double rates[MECHC_MOST_RATES][MECHC_NX], at[MECHC_NX];
    mechc_before_projection(stages->tangents + n * d->block, d, covector, gradient);
    const double *weights = tableau->matrix + count * MECHC_MOST_RATES;
    for (int i = 0; i < count; i++)
        for (int k = 0; k < MECHC_NX; k++) rates[i][k] = h * weights[i] * covector[k];
    for (int i = count - 1; i >= 0; i--) {
        const double *block = stages->slopes + (i * MECHC_LANES + n) * d->block;
        const double *row = tableau->matrix + i * MECHC_MOST_RATES;
        const int known = MECHC_IDENTITY_KINEMATICS && !stages->kept[i] ? MECHC_NQ : 0;
        memset(at, 0, sizeof at);
        for (int k = 0; k < known; k++) at[MECHC_NQ + k] = rates[i][k];
        mechc_by_state(block, known, MECHC_NX - known, rates[i] + known, at);
        mechc_by_given(block, known, MECHC_NX - known, rates[i] + known, d, gradient);
        for (int k = 0; k < MECHC_NX; k++) covector[k] += at[k];
        for (int j = 0; j < i; j++)
            for (int k = 0; row[j] != 0.0 && k < MECHC_NX; k++) rates[j][k] += h * row[j] * at[k];
    }
}

/* The transposed equations of a step's stages, K^T z = w; unknown i of stage a has the place
 * a size + i.  nq: coordinates where q' = u is integrated twice, else 0. */
typedef struct {
    const mechc_rule *rule;
    const mechc_nodes_at_hand *nodes;
    const mechc_directions *d;
    double h;
    int nq, size;
    double w[MECHC_VARIED_NODES * MECHC_NX], z[MECHC_VARIED_NODES * MECHC_NX];
    double by_state[MECHC_VARIED_NODES][MECHC_NX]; /* A_a^T z_a */
} mechc_costages;

MECHC_INLINE const double *mechc_costage_block(const mechc_costages *c, int a)
{
    return c->nodes->slopes + a * c->d->block;
}

MECHC_STATIC void mechc_costages_by_state(mechc_costages *c)
{
    memset(c->by_state, 0, sizeof c->by_state);
    for (int a = 0; a < c->rule->stages; a++)
        mechc_by_state(mechc_costage_block(c, a), c->nq, c->size, c->z + a * c->size,
                       c->by_state[a]);
}

/* z <- w + E^T z, where K = I - E; the largest change. */
MECHC_STATIC double mechc_costages_iterate(mechc_costages *c)
{
    const mechc_rule *rule = c->rule;
    double change = 0.0;
    mechc_costages_by_state(c);
    for (int b = 0; b < rule->stages; b++) {
        double next[MECHC_NX];
        memcpy(next, c->w + b * c->size, (size_t)c->size * sizeof(double));
        for (int a = 0; a < rule->stages; a++) {
            const double once = c->h * rule->first[a][b];
            const double twice = c->h * c->h * rule->second[a][b];
            for (int k = 0; k < c->size; k++) next[k] += once * c->by_state[a][c->nq + k];
            for (int k = 0; k < c->nq; k++) next[k] += twice * c->by_state[a][k];
        }
        for (int k = 0; k < c->size; k++) {
            change = mechc_max(change, fabs(next[k] - c->z[b * c->size + k]));
            c->z[b * c->size + k] = next[k];
        }
    }
    return change;
}

/* Down to rounding; 0 where the iteration does not get there. */
MECHC_STATIC int mechc_costages_converge(mechc_costages *c)
{
    const int count = c->rule->stages * c->size;
    double before = HUGE_VAL, largest = 0.0;
    memcpy(c->z, c->w, (size_t)count * sizeof(double));
    for (int k = 0; k < count; k++) largest = mechc_max(largest, fabs(c->w[k]));
    for (int iteration = 0; iteration < MECHC_ADJOINT_ITERATIONS; iteration++) {
        const double change = mechc_costages_iterate(c);
        if (change <= 1e-16 * largest || (change >= before && change <= 1e-14 * largest)) return 1;
        if (!(change < HUGE_VAL) || (iteration > 3 && change > 2.0 * before)) return 0;
        before = change;
    }
    return 0;
}

/* By elimination. */
MECHC_STATIC int mechc_costages_eliminate(mechc_costages *c, mechc_vector *room,
                                          mechc_vector **rows)
{
    const int stages = c->rule->stages, size = c->size, count = stages * size, nq = c->nq;
    const int own = (count + MECHC_LANES - 1) / MECHC_LANES;
    for (int b = 0; b < stages; b++)
        for (int k = 0; k < size; k++) {
            mechc_vector *row = rows[b * size + k] = room + (b * size + k) * (own + 1);
            double *entries = (double *)row;
            row[own - 1] = row[own] = mechc_spread(0.0);
            for (int a = 0; a < stages; a++)
                for (int i = 0; i < size; i++) {
                    const double *slopes = mechc_costage_block(c, a) + (nq + i) * MECHC_NX;
                    const double twice = k < nq ? c->rule->second[a][b] * slopes[k] : 0.0;
                    entries[a * size + i] =
                        -c->h * (c->rule->first[a][b] * slopes[nq + k] + c->h * twice);
                }
            entries[b * size + k] += 1.0;
            row[own][0] = c->w[b * size + k];
        }
    if (!mechc_eliminate(rows, count, own, own + 1, 1)) return 0;
    for (int k = 0; k < count; k++) c->z[k] = rows[k][own][0];
    return 1;
}

/* One step by collocation whose nodes are at hand; 0 where its equations are singular. */
MECHC_STATIC int mechc_nodes_back(mechc_varying *w, mechc_costages *c, const double *tangent,
                                  double *covector, double *gradient)
{
    const mechc_rule *rule = c->rule;
    const int end = rule->stages, size = c->size, nq = c->nq;
    mechc_before_projection(tangent, c->d, covector, gradient);
    for (int b = 0; b < rule->stages; b++)
        for (int k = 0; k < size; k++) {
            const double twice = k < nq ? c->h * rule->second[end][b] * covector[k] : 0.0;
            c->w[b * size + k] = c->h * (rule->first[end][b] * covector[nq + k] + twice);
        }
    const int iterated = rule->stages == MECHC_STAGES && mechc_costages_converge(c);
    if (!iterated && !mechc_costages_eliminate(c, w->room, w->rows)) return 0;
    mechc_costages_by_state(c);
    for (int k = 0; k < nq; k++) covector[nq + k] += c->h * covector[k];
    for (int a = 0; a < rule->stages; a++) {
        for (int k = 0; k < MECHC_NX; k++) covector[k] += c->by_state[a][k];
        for (int k = 0; k < nq; k++)
            covector[nq + k] += c->h * rule->nodes[a] * c->by_state[a][k];
        mechc_by_given(mechc_costage_block(c, a), nq, size, c->z + a * size, c->d, gradient);
    }
    return 1;
}

/* What was added at the start of a step. */
MECHC_INLINE void mechc_add_source(const mechc_covariation *v, ptrdiff_t step)
{
    const double *source = v->sources + (step - v->first) * MECHC_NX;
    for (int k = 0; v->sources && k < MECHC_NX; k++) v->covector[k] += source[k];
}

/* Steps first ... first + count - 1 by one method, the last first. */
MECHC_STATIC int mechc_covary_alike(mechc_varying *w, const mechc_covariation *v, int method,
                                    ptrdiff_t first, int count)
{
    const mechc_trajectory *record = v->trajectory;
    const mechc_directions *d = &w->directions;
    const mechc_tableau *tableau = mechc_pair_tableau(method);
    const mechc_rule *rule = &w->rules[method == MECHC_RADAU5];
    const int pair = mechc_is_pair(method);
    if (pair)
        mechc_take_pair_stages(method, record, first, count, tableau->stages, &w->given, d,
                               &w->stages);
    else mechc_end_tangents(&w->given, record, first, count, d, w->tangents);
    for (int n = count - 1; n >= 0; n--) {
        const double h = record->t[first + n + 1] - record->t[first + n];
        if (pair) {
            mechc_pair_back(tableau, &w->stages, n, h, d, v->covector, v->gradient);
        } else {
            mechc_take_nodes(method, rule, record, first + n, &w->given, d, &w->nodes);
            const int nq = mechc_integrates_twice(rule, w->nodes.kept) ? MECHC_NQ : 0;
            mechc_costages c = {rule, &w->nodes, d, h, nq, MECHC_NX - nq, {0}, {0}, {{0}}};
            if (!mechc_nodes_back(w, &c, w->tangents + n * d->block, v->covector, v->gradient))
                return 0;
        }
        mechc_add_source(v, first + n);
    }
    return 1;
}

/* As mechc_vary. */
MECHC_ONCE int mechc_covary(const mechc_covariation *v)
{
    const unsigned char *methods = v->trajectory->methods;
    double *unit = calloc((size_t)(MECHC_NB * v->columns + 1), sizeof *unit);
    if (!unit) return MECHC_MEMORY_LIMIT;
    for (int i = 0; i < MECHC_NB; i++) unit[i * (v->columns + 1)] = 1.0;
    mechc_varying *w =
        mechc_new_varying(v->trajectory, v->p, v->inputs, unit, v->columns, v->shapes);
    free(unit);
    if (!w) return MECHC_MEMORY_LIMIT;
    int whole = 1;
    for (ptrdiff_t last = v->last; whole && last > v->first;) {
        int count = 1;
        while ((last - count) % MECHC_LANES && last - count > v->first
               && methods[last - count - 1] == methods[last - 1])
            count++;
        whole = mechc_covary_alike(w, v, methods[last - 1], last - count, count);
        last -= count;
    }
    mechc_free_varying(w);
    return whole ? MECHC_RUNNING : MECHC_NOT_FINITE;
}
#endif
