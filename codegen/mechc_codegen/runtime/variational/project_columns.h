/* Columns of derivatives at many states of a run, each moved onto the tangent space there: several
 * states in the lanes, all columns at once. */
#pragma once

#include "abi/variation.h"
#include "variational/vary.h"

#if MECHC_VARIATIONAL
#if MECHC_NC > 0
/* Project the columns at `count` <= MECHC_LANES states from `first` on. */
MECHC_STATIC void mechc_project_in_lanes(mechc_varying *w, const mechc_projected_columns *v,
                                         ptrdiff_t first, int count)
{
    const mechc_directions *d = &w->directions;
    mechc_vector time, state[MECHC_NX], block[MECHC_NX * MECHC_SLOPES];
    mechc_fill_lanes(v->t + first, count, 1, &time);
    mechc_fill_lanes(v->y + first * MECHC_NX, count, MECHC_NX, state);
    mechc_vector_tangent(time, state, &w->given.vector, block);
    mechc_along_columns(block, 0, v->t + first, count, d, w->tangents);
    for (int n = 0; n < count; n++) {
        double *columns = v->columns + (first + n) * MECHC_NX * d->columns;
        mechc_load_columns(w, columns);
        mechc_move_columns(w, w->tangents + n * d->block);
        mechc_store_columns(w, columns);
    }
}
#endif

/* Project columns at all states; returns MECHC_RUNNING or MECHC_MEMORY_LIMIT. */
MECHC_ONCE int mechc_project_columns(const mechc_projected_columns *v)
{
#if MECHC_NC > 0
    mechc_varying *w =
        mechc_new_varying(v->trajectory, v->p, v->inputs, v->directions, v->count, v->shapes);
    if (!w) return MECHC_MEMORY_LIMIT;
    for (ptrdiff_t first = 0; first < v->states; first += MECHC_LANES) {
        const ptrdiff_t left = v->states - first;
        mechc_project_in_lanes(w, v, first, left < MECHC_LANES ? (int)left : MECHC_LANES);
    }
    mechc_free_varying(w);
#else
    (void)v;
#endif
    return MECHC_RUNNING;
}
#endif
