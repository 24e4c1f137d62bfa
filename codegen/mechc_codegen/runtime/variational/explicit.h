/* The variational equations S' = A S + B over steps of an explicit pair, stage by stage: the
 * derivative of the step as it was taken.  Stages are taken again, those of several steps in the
 * lanes; then each step's columns, several in the lanes.
 */
#pragma once

#include "methods/dormand_prince_tableaus.h"
#include "variational/columns.h"

#if MECHC_VARIATIONAL
/* Data of up to MECHC_LANES steps: rates, whether those of some steps are of projected states,
 * their derivatives, and derivatives of the projection of the ends. */
typedef struct {
    double t[MECHC_LANES], y[MECHC_LANES * MECHC_NX_MAX];
    double rates[MECHC_MOST_RATES][MECHC_LANES * MECHC_NX_MAX];
    int kept;
    double *slopes, *tangents; /* MECHC_LANES blocks a rate, a block a step */
} mechc_pair_stages;

#define MECHC_TABLEAU_PAIR(name) &mechc_##name##_tableau
#define MECHC_TABLEAU_GAUSS(name) 0
#define MECHC_TABLEAU_RADAU(name) 0
#define MECHC_TABLEAU_OF(name, NUMBER, number, PART, degree, RULE, ...) MECHC_TABLEAU_##RULE(name),

/* The tableau of an explicit pair; of another method NULL. */
MECHC_INLINE const mechc_tableau *mechc_pair_tableau(int method)
{
    static const mechc_tableau *const tableaus[] = {MECHC_METHOD_TABLE(MECHC_TABLEAU_OF)};
    return tableaus[method];
}

/* Compute the states of stage i. */
MECHC_STATIC void mechc_pair_states(const mechc_tableau *tableau, const mechc_steps *steps, int i,
                                    mechc_pair_stages *stages)
{
    const double *t = steps->record->t + steps->first, *y = steps->record->y + steps->first * MECHC_NX;
    const int count = steps->count;
    const double *row = tableau->matrix + i * MECHC_MOST_RATES;
    double sum[MECHC_LANES * MECHC_NX_MAX] = {0.0};
    for (int j = 0; j < i; j++)
        for (int k = 0; row[j] != 0.0 && k < count * MECHC_NX; k++)
            sum[k] += row[j] * stages->rates[j][k];
    for (int n = 0; n < count; n++, t++, y += MECHC_NX) {
        stages->t[n] = mechc_within(t[0], t[1], tableau->nodes[i]);
        for (int k = 0; k < MECHC_NX; k++)
            stages->y[n * MECHC_NX + k] = y[k] + (t[1] - t[0]) * sum[n * MECHC_NX + k];
    }
}

/* Add the lanes whose current stage the method keeps on the constraints; returns 1 if there are
 * more.  The stages of a step are all kept or none is: rates with and without projection differ off
 * the constraints, and a step by both has a low order. */
MECHC_STATIC int mechc_keeps_more(int method, const mechc_steps *steps, const mechc_pair_stages *stages,
                                  mechc_mask *along)
{
    const mechc_mask more =
        ~*along & mechc_kept_states(method, steps->given, steps->count, stages->t, stages->y);
    *along |= more;
    return mechc_any(more);
}

/* The first `rates` rates of the steps, and the projection of their ends. */
MECHC_ONCE void mechc_take_pair_stages(int method, const mechc_steps *steps, int rates,
                                       const mechc_directions *d, mechc_pair_stages *stages)
{
    const mechc_tableau *tableau = mechc_pair_tableau(method);
    const double *ends = steps->record->y + (steps->first + 1) * MECHC_NX;
    mechc_mask along = {0};
    for (int i = 0; i < rates; i++) {
        mechc_pair_states(tableau, steps, i, stages);
        if (i == tableau->stages)
            memcpy(stages->y, ends, (size_t)(steps->count * MECHC_NX) * sizeof(double));
        if (i < tableau->stages && mechc_keeps_more(method, steps, stages, &along)) {
            i = -1; /* from the first stage on */
            continue;
        }
        mechc_linearise_states(along, steps->given, steps->count, stages->t, stages->y, d,
                               stages->rates[i], stages->slopes + i * MECHC_LANES * d->block);
    }
    stages->kept = mechc_any(along);
    mechc_end_tangents(steps, d, stages->tangents);
}

/* S' of one vector of columns at a stage. */
MECHC_INLINE void mechc_stage_rates(const double *slopes, int kept, const mechc_vector *at,
                                    int width, int block, mechc_vector *rates)
{
    const int given = MECHC_IDENTITY_KINEMATICS && !kept ? MECHC_NQ : 0;
    for (int i = 0; i < given; i++) rates[i] = at[MECHC_NQ + i];
    for (int i = given; i < MECHC_NX; i++)
        rates[i] = mechc_row_along(slopes, i, width, block, at, 1);
}

/* start + h sum_j row[j] rates[j], j < count */
MECHC_INLINE void mechc_stage_columns(const double *row, int count, double h,
                                      const mechc_vector *start, int stride,
                                      mechc_vector rates[][MECHC_NX_MAX], mechc_vector *at)
{
    for (int k = 0; k < MECHC_NX; k++) at[k] = start[k * stride];
    for (int j = 0; j < count; j++)
        if (row[j] != 0.0) {
            const double weight = h * row[j];
            for (int k = 0; k < MECHC_NX; k++) at[k] += weight * rates[j][k];
        }
}

/* Move one vector of columns over step n of the current ones; count: number of its rates. */
MECHC_STATIC void mechc_pair_columns(const mechc_tableau *tableau, const mechc_pair_stages *stages,
                                     int n, double h, int count, const mechc_directions *d,
                                     int block, const mechc_vector *start, mechc_vector *end,
                                     mechc_vector rates[][MECHC_NX_MAX])
{
    mechc_vector at[MECHC_NX_MAX];
    const double *tangent = stages->tangents + n * d->block;
    for (int i = 0; i < count; i++) {
        const double *row = tableau->matrix + i * MECHC_MOST_RATES;
        mechc_stage_columns(row, i, h, start, d->width, rates, at);
        if (i == tableau->stages) mechc_onto_tangent(tangent, d->width, block, at);
        mechc_stage_rates(stages->slopes + (i * MECHC_LANES + n) * d->block, stages->kept, at,
                          d->width, block, rates[i]);
    }
    const double *row = tableau->matrix + tableau->stages * MECHC_MOST_RATES;
    mechc_stage_columns(row, tableau->stages, h, start, d->width, rates, at);
    mechc_onto_tangent(tangent, d->width, block, at);
    for (int k = 0; k < MECHC_NX; k++) end[k * d->width] = at[k];
}
#endif
