/* A piece of a motion: the steps of one run, and what was constant in them. */
#pragma once

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "abi/model.h"
#include "abi/macros.h"

typedef struct {
    int owners;                    /* who reads it; the last one frees it */
    const mechc_trajectory *steps; /* those of the run under way, or its own */
    mechc_trajectory own;
    double cut;    /* time of the event that ended it within its last step; NaN: none */
    int jumps;     /* the state jumps at its start, */
    int causes;    /* by the resets of these events, in order */
    int *cause;
    double *p;     /* parameters */
    int contacts;  /* the state of each contact, mechc_contact_state */
    unsigned char *contact;
} mechc_piece;

MECHC_STATIC void mechc_free_steps(mechc_trajectory *steps)
{
    free(steps->t);
    free(steps->y);
    free(steps->dense);
    free(steps->methods);
    free(steps->crossings);
}

/* Release a piece by one reader; the last one frees it. */
MECHC_STATIC void mechc_piece_leave(mechc_piece *piece)
{
    if (!piece || __atomic_sub_fetch(&piece->owners, 1, __ATOMIC_ACQ_REL)) return;
    mechc_free_steps(&piece->own);
    free(piece->p);
    free(piece->cause);
    free(piece->contact);
    free(piece);
}

/* Create a piece; NULL without memory. */
MECHC_STATIC mechc_piece *mechc_piece_make(const double *p, int parameters, int causes, int contacts)
{
    mechc_piece *piece = calloc(1, sizeof *piece);
    if (!piece) return 0;
    piece->owners = 1;
    piece->cut = NAN;
    piece->causes = causes;
    piece->contacts = contacts;
    piece->p = malloc((size_t)(parameters + 1) * sizeof *piece->p);
    piece->cause = malloc((size_t)(causes + 1) * sizeof *piece->cause);
    piece->contact = calloc((size_t)contacts + 1, 1);
    if (!piece->p || !piece->cause || !piece->contact) {
        mechc_piece_leave(piece);
        return 0;
    }
    memcpy(piece->p, p, (size_t)parameters * sizeof *p);
    return piece;
}

MECHC_STATIC mechc_piece *mechc_piece_share(mechc_piece *piece)
{
    __atomic_add_fetch(&piece->owners, 1, __ATOMIC_RELAXED);
    return piece;
}

/* Drop all steps but the last state, such that the run continues as if it kept all. */
MECHC_STATIC void mechc_keep_last(mechc_trajectory *steps)
{
    const ptrdiff_t last = steps->count - 1, width = steps->width;
    if (last < 1) return;
    steps->dropped[1] = last > 1 ? steps->t[last - 2] : steps->dropped[0];
    steps->dropped[0] = steps->t[last - 1];
    steps->dropped_count = last > 1 || steps->dropped_count ? 2 : 1;
    steps->t[0] = steps->t[last];
    memmove(steps->y, steps->y + last * width, (size_t)width * sizeof(double));
    steps->count = 1;
}

/* Take over the steps of a run that has ended. */
MECHC_STATIC void mechc_piece_take(mechc_piece *piece, mechc_run *run)
{
    piece->own = run->trajectory;
    piece->steps = &piece->own;
    memset(&run->trajectory, 0, sizeof run->trajectory);
}
