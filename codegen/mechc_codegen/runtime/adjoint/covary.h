/* Covectors backwards over the steps of a run: the adjoint of the steps as they were taken, the
 * transposed of variational/vary.h, operation by operation.
 *
 * Its cost does not grow with the number of parameters.  Sanz-Serna (2016), SIAM Review 58.
 */
#pragma once

#include "adjoint/elimination.h"
#include "adjoint/gauss.h"
#include "adjoint/pairs.h"

#if MECHC_VARIATIONAL
/* Go back over a step by collocation; 0 if its equations are singular or without memory. */
MECHC_STATIC int mechc_nodes_back(mechc_covarying *w, const mechc_covariation *v, int method,
                                  ptrdiff_t step, double h)
{
    const mechc_derivative_rule number = mechc_rule_of(method);
    const mechc_rule *rule = &w->rules[number];
    mechc_place_nodes(method, rule, v->trajectory, step, &w->given, &w->nodes);
    if (number == MECHC_RULE_GAUSS && mechc_gauss_back(w, v, &w->nodes, h)) return 1;
    if (!w->blocks) w->blocks = mechc_new_blocks(v);
    if (!w->blocks) return 0;
    mechc_place_nodes(method, rule, v->trajectory, step, &w->given, &w->blocks->nodes);
    return mechc_eliminated_back(w->blocks, rule, h, v->covector, v->gradient);
}

/* Go back over steps first ... first + count - 1 of one method, the last first. */
MECHC_STATIC int mechc_covary_alike(mechc_covarying *w, const mechc_covariation *v, int method,
                                    ptrdiff_t first, int count)
{
    const mechc_trajectory *record = v->trajectory;
    const mechc_steps steps = {record, first, count, &w->given};
    const mechc_tableau *tableau = mechc_pair_tableau(method);
    if (tableau) mechc_take_stages_back(w, tableau, method, &steps);
#if MECHC_NC_MAX > 0
    mechc_tangents_in_lanes(&steps, w->ends, w->tangents);
#endif
    for (int n = count - 1; n >= 0; n--) {
        const double h = record->t[first + n + 1] - record->t[first + n];
#if MECHC_SWITCHES_MAX
        mechc_before_jumps(w, v, first + n);
#endif
#if MECHC_NC_MAX > 0
        mechc_before_projection(w, v, n);
#endif
        if (tableau) mechc_pair_back(w, v, tableau, n, h);
        else if (!mechc_nodes_back(w, v, method, first + n, h)) return 0;
        const double *source = v->sources + (first + n - v->first) * MECHC_NX; /* at its start */
        for (int k = 0; v->sources && k < MECHC_NX; k++) v->covector[k] += source[k];
    }
    return 1;
}

/* Allocate the work space; NULL without memory. */
MECHC_STATIC mechc_covarying *mechc_new_covarying(const mechc_covariation *v)
{
    mechc_covarying *w = mechc_new_aligned(sizeof *w);
    if (!w) return 0;
    memset(w->gathered, 0, sizeof w->gathered);
    w->blocks = 0;
    mechc_give_twice(v->trajectory, v->p, v->inputs, &w->given);
    mechc_gauss_rule(&w->rules[MECHC_RULE_GAUSS]);
    mechc_radau_rule(&w->rules[MECHC_RULE_RADAU]);
    return w;
}

#define MECHC_GATHERED 8 /* steps, whose derivatives are summed before those of others */

/* Go back over all steps; arguments and results as of mechc_vary. */
MECHC_ONCE int mechc_covary(const mechc_covariation *v)
{
    const unsigned char *methods = v->trajectory->methods;
    mechc_covarying *w = mechc_new_covarying(v);
    if (!w) return MECHC_MEMORY_LIMIT;
    int whole = 1;
    for (ptrdiff_t last = v->last; whole && last > v->first;) {
        int count = 1;
        while ((last - count) % MECHC_LANES && last - count > v->first
               && methods[last - count - 1] == methods[last - 1])
            count++;
        whole = mechc_covary_alike(w, v, methods[last - 1], last - count, count);
        last -= count;
        if (last % MECHC_GATHERED && last > v->first && whole) continue;
        /* the sum depends neither on how many steps a call covers nor on the lanes */
        for (int k = 0; k < MECHC_NB; k++) v->gradient[k] += mechc_sum_of_parts(w->gathered[k]);
        memset(w->gathered, 0, sizeof w->gathered);
    }
    mechc_free_varying(w->blocks);
    mechc_free_aligned(w);
    return whole ? MECHC_RUNNING : MECHC_NOT_FINITE;
}
#endif
