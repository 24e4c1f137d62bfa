/* Columns of derivatives over the steps of a run, each step by the method that made it. */
#pragma once

#include "variational/explicit.h"
#include "variational/jumps.h"
#include "variational/propagators.h"

#if MECHC_VARIATIONAL
/* Work space of a call. */
typedef struct {
    mechc_given_twice given;
    mechc_rule rules[2]; /* by their numbers */
    mechc_pair_stages stages;
    mechc_nodes_at_hand nodes;
    mechc_directions directions;
    double *tangents; /* of the ends of MECHC_LANES steps of collocation, or propagators */
    double *jump;     /* at the end of one */
#if MECHC_PROPAGATES_CODE
    mechc_propagation propagation;
#endif
    mechc_vector *room, **rows;     /* of an elimination */
    mechc_vector *before, *after;   /* columns of a step */
} mechc_varying;

MECHC_STATIC void mechc_free_varying(mechc_varying *w)
{
    if (!w) return;
    mechc_free_directions(&w->directions);
    mechc_free_aligned(w->stages.slopes);
    mechc_free_aligned(w->tangents);
    mechc_free_aligned(w->nodes.slopes);
    mechc_free_aligned(w->jump);
    mechc_free_aligned(w->room);
    free(w->rows);
    mechc_free_aligned(w->before);
    mechc_free_aligned(w->after);
    mechc_free_aligned(w);
}

/* Allocate the work space; NULL without memory. */
MECHC_STATIC mechc_varying *mechc_new_varying(const mechc_trajectory *record, const double *p,
                                              const mechc_inputs *inputs, const double *directions,
                                              int columns, const mechc_shapes *shapes)
{
    const size_t most = MECHC_VARIED_NODES * MECHC_NX;
    mechc_varying *w = mechc_new_aligned(sizeof *w);
    if (!w) return 0;
    memset(w, 0, sizeof *w);
    const int taken = mechc_take_directions(directions, columns, shapes, &w->directions);
    const size_t width = (size_t)w->directions.width;
    const size_t block = w->directions.block / MECHC_LANES;
    w->stages.slopes = (double *)mechc_new_vectors(MECHC_MOST_RATES * MECHC_LANES * block);
    w->tangents = w->stages.tangents = (double *)mechc_new_vectors(MECHC_LANES * block);
    w->nodes.slopes = (double *)mechc_new_vectors(MECHC_VARIED_NODES * block);
    w->jump = (double *)mechc_new_vectors(MECHC_LANES * block);
    w->room = mechc_new_vectors(most * (most / MECHC_LANES + 1 + width));
    w->rows = malloc(most * sizeof *w->rows);
    w->before = mechc_new_vectors(MECHC_NX * width);
    w->after = mechc_new_vectors(MECHC_NX * width);
    if (!taken || !w->stages.slopes || !w->tangents || !w->nodes.slopes || !w->jump || !w->room || !w->rows || !w->before || !w->after) {
        mechc_free_varying(w);
        return 0;
    }
    mechc_give_twice(record, p, inputs, &w->given);
    mechc_gauss_rule(&w->rules[MECHC_RULE_GAUSS]);
    mechc_radau_rule(&w->rules[MECHC_RULE_RADAU]);
    return w;
}

MECHC_INLINE double *mechc_rates_of(const mechc_variation *v, ptrdiff_t step, int count)
{
    return v->rates ? v->rates + (step - v->first) * count * MECHC_NX * v->columns : 0;
}

/* NX rows of columns into the work space, and the new ones out of it. */
MECHC_INLINE void mechc_load_columns(mechc_varying *w, const double *rows)
{
    const mechc_directions *d = &w->directions;
    for (int i = 0; i < MECHC_NX; i++)
        mechc_pad(rows + i * d->columns, d->columns, d->width, w->before + i * d->width);
}

MECHC_INLINE void mechc_store_columns(const mechc_varying *w, double *rows)
{
    const mechc_directions *d = &w->directions;
    for (int i = 0; i < MECHC_NX; i++)
        mechc_unpad(w->after + i * d->width, d->columns, rows + i * d->columns);
}

/* Move the columns by an affine map. */
MECHC_INLINE void mechc_move_columns(mechc_varying *w, const double *block)
{
    const mechc_directions *d = &w->directions;
    for (int i = 0; i < MECHC_NX; i++)
        for (int k = 0; k < d->width; k++)
            w->after[i * d->width + k] =
                mechc_row_along(block, i, d->width, k, w->before + k, d->width);
}

#if MECHC_SWITCHES_MAX
/* Move the columns at the end of a step over the jumps of laws in it. */
MECHC_STATIC void mechc_vary_jumps(mechc_varying *w, const mechc_trajectory *record, ptrdiff_t step)
{
    double map[MECHC_NX_MAX * MECHC_SLOPES_MAX];
    mechc_vector lanes[MECHC_NX_MAX * MECHC_SLOPES_MAX], *const start = w->before, *const end = w->after;
    if (!mechc_jumps_of_step(&w->given, record, step, map)) return;
    for (int i = 0; i < MECHC_NX * MECHC_SLOPES; i++) lanes[i] = mechc_spread(map[i]);
    mechc_along_columns(lanes, 0, &record->t[step + 1], 1, &w->directions, w->jump);
    w->before = end;
    w->after = w->room;
    mechc_move_columns(w, w->jump);
    memcpy(end, w->room, (size_t)(MECHC_NX * w->directions.width) * sizeof *end);
    w->before = start;
    w->after = end;
}
#endif

/* Write the columns at the end of a step from the work space; they are the next step's start.  Dense
 * output is of those before a jump. */
MECHC_INLINE void mechc_end_step(mechc_varying *w, const mechc_variation *v, ptrdiff_t step)
{
    mechc_vector *const kept = w->before;
    double *const ends = v->ends + (step + 1 - v->first) * MECHC_NX * v->columns;
    if (v->rates) mechc_store_columns(w, ends);
#if MECHC_SWITCHES_MAX
    mechc_vary_jumps(w, v->trajectory, step);
#endif
    if (!v->rates) mechc_store_columns(w, ends);
    if (!v->restart) w->before = w->after, w->after = kept;
}

/* Move the columns over `count` steps of an explicit pair from `step` on. */
MECHC_STATIC void mechc_vary_pairs(mechc_varying *w, const mechc_variation *v, int method,
                                   ptrdiff_t step, int count)
{
    const mechc_tableau *tableau = mechc_pair_tableau(method);
    const int taken = v->rates ? tableau->rates : tableau->stages;
    const mechc_steps steps = {v->trajectory, step, count, &w->given};
    mechc_take_pair_stages(method, &steps, taken, &w->directions, &w->stages);
    for (int n = 0; n < count; n++, step++) {
        const double h = v->trajectory->t[step + 1] - v->trajectory->t[step];
        for (int block = 0; block < w->directions.width; block++) {
            mechc_vector rates[MECHC_MOST_RATES][MECHC_NX_MAX];
            mechc_pair_columns(tableau, &w->stages, n, h, taken, &w->directions, block,
                               w->before + block, w->after + block, rates);
            const int left = v->columns - block * MECHC_LANES;
            for (int i = 0; v->rates && i < taken * MECHC_NX; i++)
                mechc_unpad(&rates[i / MECHC_NX][i % MECHC_NX], left < MECHC_LANES ? left : MECHC_LANES,
                            mechc_rates_of(v, step, taken) + i * v->columns + block * MECHC_LANES);
        }
        mechc_end_step(w, v, step);
    }
}

/* Move the columns over Gauss steps by their propagators; 0 if these cannot be computed. */
MECHC_STATIC int mechc_vary_propagated(mechc_varying *w, const mechc_variation *v, ptrdiff_t step,
                                       int count)
{
#if MECHC_PROPAGATES_CODE
    if (!MECHC_PROPAGATES) return 0;
    const mechc_directions *d = &w->directions;
    mechc_propagation *g = &w->propagation;
    const mechc_steps steps = {v->trajectory, step, count, &w->given};
    if (!mechc_propagate(&w->rules[MECHC_RULE_GAUSS], &steps, g)) return 0;
    mechc_along_columns(g->whole, 0, 0, count, d, w->tangents);
    for (int n = 0; n < count; n++) {
        mechc_move_columns(w, w->tangents + n * d->block);
        mechc_end_step(w, v, step + n);
    }
    return 1;
#else
    (void)w, (void)v, (void)step, (void)count;
    return 0;
#endif
}

/* Move the columns over `count` steps by collocation; 0 if the equations of one are singular. */
MECHC_STATIC int mechc_vary_nodes(mechc_varying *w, const mechc_variation *v, int method,
                                  ptrdiff_t step, int count)
{
    const mechc_derivative_rule number = mechc_rule_of(method);
    const mechc_rule *rule = &w->rules[number];
    const mechc_directions *d = &w->directions;
    int whole = 1;
    const int constant = !d->shapes; /* so are the changes along columns, within a step */
    if (number == MECHC_RULE_GAUSS && constant && !v->rates && mechc_vary_propagated(w, v, step, count))
        return 1;
    const mechc_steps steps = {v->trajectory, step, count, &w->given};
    mechc_end_tangents(&steps, d, w->tangents);
    for (int n = 0; n < count; n++, step++) {
        const double h = v->trajectory->t[step + 1] - v->trajectory->t[step];
        mechc_place_nodes(method, rule, v->trajectory, step, &w->given, &w->nodes);
        mechc_linearise_nodes(rule, &w->given, d, &w->nodes);
        const mechc_step_equations equations = {.rule = rule, .nodes = &w->nodes, .d = d, .h = h};
        whole &= mechc_collocate(&equations, w->tangents + n * d->block, w->before, w->room, w->rows,
                                 w->after, mechc_rates_of(v, step, rule->stages));
        mechc_end_step(w, v, step);
    }
    return whole;
}

#if MECHC_NC_MAX > 0
/* Move the columns at `count` <= MECHC_LANES times and states, each onto the tangent space there. */
MECHC_STATIC void mechc_project_in_lanes(mechc_varying *w, const double *t, const double *y, int count,
                                         double *columns)
{
    const mechc_directions *d = &w->directions;
    mechc_vector time, state[MECHC_NX_MAX], block[MECHC_NX_MAX * MECHC_SLOPES_MAX];
    mechc_fill_lanes(t, count, 1, &time);
    mechc_fill_lanes(y, count, MECHC_NX, state);
    mechc_vector_tangent(time, state, &w->given.vector, block);
    mechc_along_columns(block, 0, t, count, d, w->tangents);
    for (int n = 0; n < count; n++, columns += MECHC_NX * d->columns) {
        mechc_load_columns(w, columns);
        mechc_move_columns(w, w->tangents + n * d->block);
        mechc_store_columns(w, columns);
    }
}

MECHC_STATIC void mechc_project_start(mechc_varying *w, const mechc_variation *v)
{
    const double *t = v->trajectory->t + v->first, *y = v->trajectory->y + v->first * MECHC_NX;
    const double at = v->trajectory->count > 1 ? mechc_within(t[0], t[1], 0.0) : t[0];
    mechc_project_in_lanes(w, &at, y, 1, v->ends);
}
#endif

/* Move the columns over all steps.  Returns MECHC_RUNNING, MECHC_MEMORY_LIMIT, or MECHC_NOT_FINITE if a
 * step's equations are singular.  Not marked as rare: all that it alone calls would be compiled for size. */
MECHC_ONCE int mechc_vary(const mechc_variation *v)
{
    const unsigned char *methods = v->trajectory->methods;
    mechc_varying *w = mechc_new_varying(v->trajectory, v->p, v->inputs, v->directions,
                                         v->columns, v->shapes);
    if (!w) return MECHC_MEMORY_LIMIT;
    int whole = 1;
#if MECHC_NC_MAX > 0
    if (v->project) mechc_project_start(w, v);
#endif
    mechc_load_columns(w, v->ends);
    for (ptrdiff_t step = v->first; whole && step < v->last;) {
        int count = 1;
        while ((step + count) % MECHC_LANES && step + count < v->last
               && methods[step + count] == methods[step])
            count++;
        if (mechc_pair_tableau(methods[step])) mechc_vary_pairs(w, v, methods[step], step, count);
        else whole = mechc_vary_nodes(w, v, methods[step], step, count);
        step += count;
    }
    mechc_free_varying(w);
    return whole ? MECHC_RUNNING : MECHC_NOT_FINITE;
}

/* Project columns at many states of a run; returns MECHC_RUNNING or MECHC_MEMORY_LIMIT. */
MECHC_ONCE int mechc_project_columns(const mechc_projected_columns *v)
{
#if MECHC_NC_MAX > 0
    mechc_varying *w =
        mechc_new_varying(v->trajectory, v->p, v->inputs, v->directions, v->count, v->shapes);
    if (!w) return MECHC_MEMORY_LIMIT;
    for (ptrdiff_t first = 0; first < v->states; first += MECHC_LANES) {
        const ptrdiff_t left = v->states - first;
        mechc_project_in_lanes(w, v->t + first, v->y + first * MECHC_NX,
                               left < MECHC_LANES ? (int)left : MECHC_LANES,
                               v->columns + first * MECHC_NX * v->count);
    }
    mechc_free_varying(w);
#else
    (void)v;
#endif
    return MECHC_RUNNING;
}
#endif
