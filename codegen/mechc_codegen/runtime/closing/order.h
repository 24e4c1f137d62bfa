/* The order of the configurations found: the nearest to the guess first, or the preferred one. */
#pragma once

#include <math.h>
#include <string.h>
#include "closing/descent.h"

/* The rank of a configuration: its distance from the guess, or how little it is preferred. */
static double mechc_close_rank(const mechc_closing *job, mechc_closer *closer, const double *q)
{
    const double *guess = job->fixed + closer->member * job->closure.coordinates;
    double rank = 0.0;
    if (job->guessed) {
        for (int i = 0; i < job->unknowns; i++) {
            if (!job->guessed[i]) continue;
            const double change = q[job->unknown[i]] - guess[job->unknown[i]];
            const double away = mechc_close_away(job, closer, i, change);
            rank += away * away;
        }
    } else if (job->closure.output[MECHC_PREFERENCE] >= 0) {
        memcpy(closer->y, q, (size_t)job->closure.coordinates * sizeof *q);
        mechc_ask(&job->closure, MECHC_PREFERENCE, 1, closer->y, closer->p, &rank);
        rank = -rank;
    }
    return rank;
}

/* Whether row a comes before row b, which has the same rank. */
static int mechc_close_before(const double *a, const double *b, int count)
{
    for (int i = 0; i < count; i++)
        if (a[i] != b[i]) return a[i] < b[i];
    return 0;
}

/* Turn angles to within half a turn of the guessed ones. */
static void mechc_close_turn(const mechc_closing *job, const double *guess, double *q)
{
    for (int i = 0; i < job->unknowns; i++) {
        const int at = job->unknown[i];
        if (job->guessed[i] && mechc_close_turns(job, i))
            q[at] += 2.0 * M_PI * round((guess[at] - q[at]) / (2.0 * M_PI));
    }
}

/* Sort the configurations: the nearest to the guess first, or the preferred one. */
static void mechc_close_order(mechc_closing *job, mechc_closer *closer)
{
    const int width = job->closure.coordinates;
    const int many = job->many[closer->member] < job->most ? job->many[closer->member] : job->most;
    double *found = job->found + closer->member * job->most * width, *rank = closer->rank;
    for (int i = 0; i < many && many > 1; i++)
        rank[i] = mechc_close_rank(job, closer, found + i * width);
    for (int i = 0; i < many; i++) {
        int first = i;
        for (int k = i + 1; k < many; k++)
            if (rank[k] < rank[first]
                || (rank[k] == rank[first]
                    && mechc_close_before(found + k * width, found + first * width, width)))
                first = k;
        if (first != i) {
            mechc_close_swap(found + i * width, found + first * width, width);
            mechc_close_swap(rank + i, rank + first, 1);
        }
        if (job->guessed)
            mechc_close_turn(job, job->fixed + closer->member * width, found + i * width);
    }
}
