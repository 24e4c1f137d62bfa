/* Configurations that close the loops, member by member, from starts spread over all of them.
 *
 * With a guess, starts are at it first; what closes nearest to it sets the distance up to which
 * others are searched for.  Where constraints leave a choice, others are searched for only if nothing
 * closes: at first about the guess.  Where nothing closes, the least gap met is made as small as it gets.
 */
#pragma once

#include <math.h>
#include <stddef.h>
#include <string.h>
#include "abi/clock.h"
#include "closing/order.h"

static void mechc_close_phase_of(const mechc_closing *job, mechc_closer *closer,
                                 mechc_close_phase phase, ptrdiff_t starts, double radius)
{
    closer->phase = phase;
    closer->next = 0;
    closer->end = starts;
    closer->radius = radius;
    while (closer->active < closer->team && mechc_close_begin(job, closer, closer->active))
        closer->active++;
}

static void mechc_close_member(mechc_closing *job, mechc_closer *closer)
{
    const ptrdiff_t member = closer->member;
    const int coordinates = job->closure.coordinates;
    closer->p = job->p + member * job->closure.parameters;
    mechc_measure_member(&closer->measure, job->fixed + member * coordinates, closer->p,
                         job->length[member]);
    for (int i = 0; i < job->unknowns; i++) {
        const int kind = job->closure.kind[job->unknown[i]];
        closer->unit[i] = kind == MECHC_TRANSLATION ? closer->measure.length : 1.0;
    }
    for (int k = 0; k < closer->team; k++)
        memcpy(closer->y + k * job->closure.width, job->fixed + member * coordinates,
               (size_t)coordinates * sizeof(double));
    closer->hits = 0;
    job->many[member] = 0;
    closer->least = HUGE_VAL;
    if (job->guessed) mechc_close_phase_of(job, closer, MECHC_PHASE_GUESS, job->near, 0.0);
    else mechc_close_phase_of(job, closer, MECHC_PHASE_SPREAD, job->starts, HUGE_VAL);
}

/* The distance of the nearest configuration found from the guess, in radians or lengths. */
static double mechc_close_nearest(const mechc_closing *job, const mechc_closer *closer)
{
    const int coordinates = job->closure.coordinates, many = job->many[closer->member];
    const double *guess = job->fixed + closer->member * coordinates;
    const double *found = job->found + closer->member * job->most * coordinates;
    double nearest = HUGE_VAL;
    for (int other = 0; other < many && other < job->most; other++) {
        double furthest = 0.0;
        for (int i = 0; i < job->unknowns; i++) {
            const int at = job->unknown[i];
            if (!job->guessed[i]) continue;
            furthest = fmax(furthest, fabs(mechc_close_away(
                job, closer, i, found[other * coordinates + at] - guess[at])));
        }
        nearest = fmin(nearest, furthest);
    }
    return nearest;
}

/* Set starts within a distance of the guess: as dense as those spread over all, and some more. */
static ptrdiff_t mechc_close_about(const mechc_closing *job, double radius)
{
    double share = 1.0;
    for (int i = 0; i < job->unknowns; i++)
        if (job->guessed[i]) share *= fmin(1.0, radius / (mechc_close_turns(job, i) ? M_PI : 1.0));
    const double some = (double)job->near + 2.0 * job->unknowns + share * (double)job->starts;
    return some < (double)job->starts ? (ptrdiff_t)some : job->starts;
}

/* The distance from the guess within which others are searched for; 0: none are.  Where constraints leave
 * a choice, others count only if the guess leads nowhere: a flat pose may be a saddle of the gap. */
static double mechc_close_further(const mechc_closing *job, const mechc_closer *closer)
{
    const int many = job->many[closer->member];
    if (job->only_near) {
        if (many || job->starts <= job->near || closer->radius == HUGE_VAL) return 0.0;
        return closer->phase == MECHC_PHASE_GUESS ? MECHC_CLOSE_STEP : HUGE_VAL;
    }
    if (closer->phase != MECHC_PHASE_GUESS || (job->enough && many >= job->enough)) return 0.0;
    return mechc_close_nearest(job, closer);
}

/* Begin the next phase after one has ended; 0: the member is done. */
static int mechc_close_next_phase(mechc_closing *job, mechc_closer *closer)
{
    const double radius = mechc_close_further(job, closer);
    if (radius > MECHC_CLOSE_SAME) {
        mechc_close_phase_of(job, closer, MECHC_PHASE_SPREAD, mechc_close_about(job, radius), radius);
        return 1;
    }
    if (!job->tells_miss || closer->phase == MECHC_PHASE_LEAST || job->many[closer->member]
        || !(closer->least < HUGE_VAL))
        return 0;
    mechc_close_phase_of(job, closer, MECHC_PHASE_LEAST, 1, HUGE_VAL);
    return 1;
}

/* Take the next member; 0: there is none. */
static int mechc_close_next_member(mechc_closing *job, mechc_closer *closer)
{
    if (++closer->member >= closer->last) {
        closer->member = __atomic_fetch_add(&job->next, job->block, __ATOMIC_RELAXED);
        closer->last = closer->member + job->block;
        if (closer->last > job->count) closer->last = job->count;
    }
    if (closer->member >= job->count) return 0;
    mechc_close_member(job, closer);
    return 1;
}

/* Record the least gap met, of the unscaled rows, and its place, for members without a solution. */
static void mechc_close_tell(const mechc_closing *job, mechc_closer *closer)
{
    const ptrdiff_t member = closer->member;
    const size_t row = (size_t)job->closure.coordinates * sizeof(double);
    job->miss[member] = closer->least;
    for (int i = 0; i < job->closure.coordinates; i++)
        job->open[member * job->closure.coordinates + i] = NAN;
    if (job->many[member] || !job->tells_miss || !(closer->least < HUGE_VAL)) return;
    memcpy(closer->y, job->fixed + member * job->closure.coordinates, row);
    for (int i = 0; i < job->unknowns; i++) closer->y[job->unknown[i]] = closer->best[i];
    memcpy(job->open + member * job->closure.coordinates, closer->y, row);
    mechc_ask(&job->closure, MECHC_GAPS, 1, closer->y, closer->p, closer->gaps);
    const int lengths = job->closure.quaternions;
    job->miss[member] = sqrt(mechc_square(closer->gaps, job->closure.rows - lengths));
}

/* Search for some seconds; 0: no member is left.  Any number of threads may do so, each with its closer. */
static int mechc_close_go_on(mechc_closing *job, mechc_closer *closer, double seconds)
{
    const double end = mechc_seconds() + seconds;
    while (!__atomic_load_n(&job->stop, __ATOMIC_RELAXED)) {
        if (closer->active) {
            mechc_close_round(job, closer);
            if (mechc_seconds() > end) return 1;
        } else if (closer->phase == MECHC_PHASE_NONE || !mechc_close_next_phase(job, closer)) {
            if (closer->phase != MECHC_PHASE_NONE) {
                mechc_close_order(job, closer);
                mechc_close_tell(job, closer);
                __atomic_fetch_add(&job->done, 1, __ATOMIC_RELAXED);
            }
            closer->phase = MECHC_PHASE_NONE;
            if (!mechc_close_next_member(job, closer)) return 0;
        }
    }
    return 0;
}
