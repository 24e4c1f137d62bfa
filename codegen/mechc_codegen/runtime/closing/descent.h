/* The descent of several starts at once to configurations that close the loops.
 *
 * Levenberg-Marquardt with the damping of Yamashita & Fukushima (2001).  Close to a solution steps
 * continue while they close the loops further: where two assemblies meet each gains a bit.
 */
#pragma once

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "closing/measure.h"

#define MECHC_CLOSE_ITERATIONS 60
#define MECHC_CLOSE_POLISHES 40
#define MECHC_CLOSE_LEAST 3000 /* steps to the least gap */
#ifndef MECHC_CLOSE_STEP
#define MECHC_CLOSE_STEP 0.7 /* the longest, rad or lengths */
#endif
#define MECHC_CLOSE_SAME 1e-6 /* rad or lengths: two configurations are one */
#define MECHC_CLOSE_NEAR 1e-6 /* of the rows' size, squared: farther off a stall is a least gap */
#define MECHC_CLOSE_STALLS 0.998 /* of the gap's square: it falls by less */
#define MECHC_CLOSE_LEAST_STALLS (1.0 - 1e-12) /* the same where the least gap is looked for */
#define MECHC_CLOSE_CUT 0.05 /* the part of a step that is tried at last */
#define MECHC_CLOSE_LEAST_CUT 1e-4 /* the same where the least gap is looked for */
#define MECHC_CLOSE_LINEAR 0.01 /* of the gap's square, that a way to a known configuration leaves */
#define MECHC_CLOSE_DAMPING 1e-14 /* of the trace, so that no pivot is rounding alone */
#define MECHC_CLOSE_KNOWN 64 /* configurations that starts are compared with on their way */
#define MECHC_CLOSE_UNSEEN 0.004 /* expected share of starts that lead to what is not found yet */
#define MECHC_CLOSE_TEAM 16  /* starts at work at once, so that outputs come from full lanes */

typedef struct {
    mechc_closure closure;
    int unknowns;
    const int *unknown;
    const unsigned char *guessed; /* an unknown each; may be NULL */
    ptrdiff_t starts, near;                 /* all; those at the guess */
    const double *start;                    /* (starts, unknowns) in (-1, 1) */
    int only_near;                          /* where the constraints leave a choice */
    int all;        /* whether every start is tried; else the search ends by MECHC_CLOSE_UNSEEN */
    int tells_miss; /* whether the least gap is looked for where nothing closes */
    ptrdiff_t count, block;
    const double *fixed; /* (count, coordinates): of the unknowns, the guess */
    const double *p, *length; /* (count,): where the search for the length begins */
    int most, enough; /* how many are kept; how many end the search, 0: none do */
    double *found;    /* (count, most, coordinates): the nearest to the guess, or preferred, first */
    int *many;        /* how many were found; may exceed `most` */
    double *miss;     /* the least gap met, of all rows as they are */
    double *open;     /* (count, coordinates): where it was met, if nothing closes */
    ptrdiff_t next, done;
    int stop;
} mechc_closing;

typedef struct {
    double size, before; /* the square of the weighted gap: now and a step ago */
    double factor;       /* of the step tried */
    double damping;      /* towards the least gap: of the usual one */
    int steps;           /* taken from this start */
} mechc_seeker;

typedef enum { MECHC_PHASE_NONE, MECHC_PHASE_GUESS, MECHC_PHASE_SPREAD, MECHC_PHASE_LEAST } mechc_close_phase;

/* The search of one thread; the first `active` rows of its arrays are at work. */
typedef struct {
    double *y, *gaps, *gradients; /* states tried, and the outputs there */
    double *x, *step, *square, *best, *unit, *rank, *cosine;
    mechc_seeker seeker[MECHC_CLOSE_TEAM];
    int team, active;
    ptrdiff_t member, last; /* of the block; none left where they are equal */
    ptrdiff_t next, end;    /* starts of this phase */
    mechc_close_phase phase;
    ptrdiff_t hits; /* starts that led to closed configurations */
    double radius;  /* about the guess, in radians or lengths */
    double least;   /* weighted gap met */
    const double *p;
    mechc_measure measure;
} mechc_closer;

static void mechc_closer_free(mechc_closer *closer)
{
    double *arrays[] = {closer->y,    closer->gaps,   closer->gradients, closer->x,
                        closer->step, closer->square, closer->best,      closer->unit,
                        closer->rank, closer->cosine};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) free(arrays[i]);
    mechc_measure_free(&closer->measure);
    free(closer);
}

static mechc_closer *mechc_closer_make(const mechc_closing *job)
{
    const size_t n = (size_t)job->unknowns, one = sizeof(double);
    const size_t team = job->starts < MECHC_CLOSE_TEAM ? (size_t)job->starts : MECHC_CLOSE_TEAM;
    const int *breadth = job->closure.breadth;
    mechc_closer *closer = calloc(1, sizeof *closer);
    if (!closer) return 0;
    closer->team = (int)team;
    closer->y = calloc(team * (size_t)job->closure.width, one);
    closer->gaps = malloc(team * (size_t)breadth[MECHC_GAPS] * one);
    closer->gradients = malloc(team * (size_t)breadth[MECHC_GRADIENT] * one);
    closer->x = malloc(team * n * one);
    closer->step = malloc(team * n * one);
    closer->square = malloc(n * n * one);
    closer->best = malloc(n * one);
    closer->unit = malloc(n * one);
    closer->rank = malloc((size_t)job->most * one);
    closer->cosine = malloc(((size_t)breadth[MECHC_DIRECTIONS] + 1) * one);
    if (closer->y && closer->gaps && closer->gradients && closer->x && closer->step
        && closer->square && closer->best && closer->unit && closer->rank
        && closer->cosine
        && mechc_measure_make(&closer->measure, &job->closure, job->unknowns, job->unknown))
        return closer;
    mechc_closer_free(closer);
    return 0;
}

static int mechc_close_turns(const mechc_closing *job, int i)
{
    return job->closure.kind[job->unknown[i]] == MECHC_ANGLE;
}

static double mechc_close_wrap(double angle)
{
    if (angle > -M_PI && angle <= M_PI) return angle;
    const double left = fmod(M_PI - angle, 2.0 * M_PI);
    return M_PI - (left < 0.0 ? left + 2.0 * M_PI : left);
}

/* Solve (G'G + damping) step = G'gap of one start by its Cholesky factors without square roots, in
 * units of the scale; the step is at most MECHC_CLOSE_STEP long. */
static inline __attribute__((always_inline)) void
mechc_close_solve_sized(const mechc_closing *job, mechc_closer *closer, int k, double damping,
                        int n, int rows)
{
    const double *gradient = closer->gradients + k * job->closure.breadth[MECHC_GRADIENT];
    const double *gap = closer->gaps + k * job->closure.breadth[MECHC_GAPS];
    const int columns = job->closure.columns;
    double *a = closer->square, *b = closer->step + k * n, trace = 0.0, longest = 0.0;
    for (int i = 0; i < n; i++) {
        const double *first = gradient + job->unknown[i];
        b[i] = 0.0;
        for (int r = 0; r < rows; r++) b[i] += first[r * columns] * gap[r];
        b[i] *= closer->unit[i];
        for (int j = 0; j <= i; j++) {
            const double *second = gradient + job->unknown[j];
            double sum = 0.0;
            for (int r = 0; r < rows; r++) sum += first[r * columns] * second[r * columns];
            a[i * n + j] = sum * closer->unit[i] * closer->unit[j];
        }
        trace += a[i * n + i];
    }
    for (int i = 0; i < n; i++) { /* below the diagonal: L D; on it: 1 / D */
        double pivot = a[i * n + i] + (damping + MECHC_CLOSE_DAMPING) * trace + DBL_MIN;
        for (int j = 0; j < i; j++) {
            double sum = a[i * n + j];
            for (int m = 0; m < j; m++) sum -= a[i * n + m] * a[m * n + m] * a[j * n + m];
            a[i * n + j] = sum;
            pivot -= sum * sum * a[j * n + j];
            b[i] -= sum * a[j * n + j] * b[j];
        }
        a[i * n + i] = 1.0 / fmax(pivot, DBL_MIN);
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int m = i + 1; m < n; m++) b[i] -= a[m * n + i] * b[m];
        b[i] *= a[i * n + i];
        longest = fmax(longest, fabs(b[i]));
    }
    const double cut = !(longest < HUGE_VAL)      ? 0.0
                     : longest > MECHC_CLOSE_STEP ? MECHC_CLOSE_STEP / longest
                                                  : 1.0;
    for (int i = 0; i < n; i++) b[i] = cut > 0.0 ? b[i] * cut : 0.0;
}

static void mechc_close_solve(const mechc_closing *job, mechc_closer *closer, int k)
{
    const double square = closer->seeker[k].size / (closer->measure.size * closer->measure.size);
    /* a gap that stays bends the residual by its own size, not by its square: Fan & Yuan (2005) */
    const double damping =
        closer->phase == MECHC_PHASE_LEAST ? closer->seeker[k].damping * sqrt(square) : square;
    if (job->unknowns == 2 && job->closure.rows == 2) /* one planar loop: sizes the compiler knows */
        mechc_close_solve_sized(job, closer, k, damping, 2, 2);
    else
        mechc_close_solve_sized(job, closer, k, damping, job->unknowns, job->closure.rows);
}

/* Set the state that start k tries next: x plus a part of the step. */
static void mechc_close_try(const mechc_closing *job, mechc_closer *closer, int k)
{
    double *y = closer->y + k * job->closure.width;
    for (int i = 0; i < job->unknowns; i++) {
        const int at = k * job->unknowns + i;
        y[job->unknown[i]] = closer->x[at]
                           - closer->seeker[k].factor * closer->step[at]
                                 * closer->unit[i];
    }
}

/* Put the next start of this phase in place k; 0 if there is none left. */
static int mechc_close_begin(const mechc_closing *job, mechc_closer *closer, int k)
{
    const int n = job->unknowns;
    const double *guess = job->fixed + closer->member * job->closure.coordinates;
    const double *start = job->start + closer->next * n;
    double *x = closer->x + k * n;
    if (closer->next >= closer->end) return 0;
    closer->next++;
    for (int i = 0; i < n; i++) {
        const double whole = mechc_close_turns(job, i) ? M_PI : 1.0;
        const int about = job->guessed && job->guessed[i] && closer->radius < whole;
        x[i] = (about ? closer->radius : whole) * start[i] * closer->unit[i]
             + (about ? guess[job->unknown[i]] : 0.0);
        closer->step[k * n + i] = 0.0;
    }
    if (closer->phase == MECHC_PHASE_LEAST) memcpy(x, closer->best, (size_t)n * sizeof *x);
    closer->seeker[k] = (mechc_seeker){HUGE_VAL, HUGE_VAL, 1.0, 1.0, 0};
    mechc_close_try(job, closer, k);
    return 1;
}

static double mechc_close_away(const mechc_closing *job, const mechc_closer *closer, int i,
                               double change)
{
    return mechc_close_turns(job, i) ? mechc_close_wrap(change) : change / closer->unit[i];
}

/* Whether start k, where the gap is as good as linear between the two, is about to come to a
 * configuration that is known: the gap is what the gradient says of the way there. */
static int mechc_close_is_known(const mechc_closing *job, const mechc_closer *closer, int k)
{
    const int n = job->unknowns, many = job->many[closer->member];
    const double *gap = closer->gaps + k * job->closure.breadth[MECHC_GAPS];
    const double *gradient = closer->gradients + k * job->closure.breadth[MECHC_GRADIENT];
    const double *found =
        job->found + closer->member * job->most * job->closure.coordinates;
    const double size = closer->seeker[k].size;
    if (n > job->closure.rows || many > job->most || many > MECHC_CLOSE_KNOWN) return 0;
    for (int other = 0; other < many; other++, found += job->closure.coordinates) {
        double furthest = 0.0, square = 0.0;
        for (int i = 0; i < n; i++)
            furthest = fmax(furthest, fabs(mechc_close_away(
                job, closer, i, closer->x[k * n + i] - found[job->unknown[i]])));
        if (furthest > 0.5) continue;
        for (int r = 0; r < job->closure.rows; r++) {
            double left = gap[r];
            for (int i = 0; i < n; i++)
                left -= gradient[r * job->closure.columns + job->unknown[i]]
                      * closer->unit[i]
                      * mechc_close_away(job, closer, i,
                                         closer->x[k * n + i] - found[job->unknown[i]]);
            square += left * left;
        }
        if (square <= MECHC_CLOSE_LINEAR * size) return 1;
    }
    return 0;
}

/* Whether the search of a start has converged: closed to rounding, or no longer gaining. */
static int mechc_close_arrived(const mechc_closer *closer, int k)
{
    const mechc_seeker *seeker = closer->seeker + k;
    const double square = closer->measure.size * closer->measure.size;
    const double rounding = 2.0 * DBL_EPSILON * closer->measure.size;
    const int near = seeker->size <= MECHC_CLOSE_NEAR * square;
    const int last = closer->phase == MECHC_PHASE_LEAST;
    const double stalls = last ? MECHC_CLOSE_LEAST_STALLS : MECHC_CLOSE_STALLS;
    const int most = last ? MECHC_CLOSE_LEAST
                          : MECHC_CLOSE_ITERATIONS + (near ? MECHC_CLOSE_POLISHES : 0);
    /* far off, it has found the least gap; close by, it stalls only at rounding */
    return seeker->size <= rounding * rounding || seeker->steps > most
        || (!near && !(seeker->size <= stalls * seeker->before));
}

/* Store the configuration that start k has reached, unless it is known; 0: it is none, as axes are
 * turned by half in it. */
static int mechc_close_keep(mechc_closing *job, mechc_closer *closer, int k)
{
    const int n = job->unknowns, coordinates = job->closure.coordinates;
    double *y = closer->y + k * job->closure.width;
    double *found = job->found + closer->member * job->most * coordinates;
    int *many = job->many + closer->member;
    for (int i = 0; i < n; i++) {
        const double x = closer->x[k * n + i];
        y[job->unknown[i]] = mechc_close_turns(job, i) ? mechc_close_wrap(x) : x;
    }
    if (mechc_is_turned(&job->closure, y, closer->p, closer->cosine)) return 0;
    for (int other = 0; other < *many && other < job->most; other++) {
        double furthest = 0.0;
        for (int i = 0; i < n && furthest <= MECHC_CLOSE_SAME; i++) {
            const int at = job->unknown[i];
            furthest = fmax(furthest, fabs(mechc_close_away(
                job, closer, i, y[at] - found[other * coordinates + at])));
        }
        if (furthest <= MECHC_CLOSE_SAME) return 1;
    }
    if (*many < job->most)
        memcpy(found + *many * coordinates, y, (size_t)coordinates * sizeof(double));
    ++*many;
    return 1;
}

/* Count another start that reached a closed configuration.  With w of them found by n starts, a share of
 * about w (w + 1) / (n (n - 1)) leads elsewhere (Boender & Rinnooy Kan 1987, Mathematical Programming). */
static void mechc_close_hit(const mechc_closing *job, mechc_closer *closer)
{
    const double w = job->many[closer->member], n = (double)++closer->hits;
    const int enough = job->enough && w >= job->enough;
    if (enough || (!job->all && w * (w + 1.0) <= MECHC_CLOSE_UNSEEN * n * (n - 1.0)))
        closer->next = closer->end = closer->active = 0;
}

/* End the search of a start. */
static void mechc_close_end(mechc_closing *job, mechc_closer *closer, int k)
{
    const double size = sqrt(closer->seeker[k].size);
    if (size < closer->least) {
        closer->least = size;
        memcpy(closer->best, closer->x + k * job->unknowns,
               (size_t)job->unknowns * sizeof(double));
    }
    if (size > MECHC_CLOSED * DBL_EPSILON * closer->measure.size) return;
    if (mechc_close_keep(job, closer, k)) mechc_close_hit(job, closer);
}

/* Judge the outputs at the trial of start k, and choose the next trial; 0 if its search is over. */
static int mechc_close_take(mechc_closing *job, mechc_closer *closer, int k)
{
    mechc_seeker *seeker = closer->seeker + k;
    const int breadth = job->closure.breadth[MECHC_GAPS], n = job->unknowns;
    const double size = mechc_square(closer->gaps + k * breadth, breadth);
    const double *y = closer->y + k * job->closure.width;
    int over;
    if (size < seeker->size) {
        seeker->before = seeker->size;
        seeker->size = size;
        if (seeker->factor == 1.0) seeker->damping *= 0.5;
        seeker->factor = 1.0;
        for (int i = 0; i < n; i++) closer->x[k * n + i] = y[job->unknown[i]];
        if (mechc_close_is_known(job, closer, k)) {
            mechc_close_hit(job, closer);
            return 0;
        }
        over = seeker->steps++ && mechc_close_arrived(closer, k);
        if (!over) mechc_close_solve(job, closer, k);
    } else { /* cut the step until it lowers the gap */
        const double least = closer->phase == MECHC_PHASE_LEAST ? MECHC_CLOSE_LEAST_CUT
                                                                 : MECHC_CLOSE_CUT;
        seeker->factor *= 0.25;
        seeker->damping *= 4.0;
        over = seeker->steps == 0 || seeker->factor < least;
    }
    if (over) mechc_close_end(job, closer, k);
    else mechc_close_try(job, closer, k);
    return !over;
}

/* Move the last active start into place k. */
static void mechc_close_remove(const mechc_closing *job, mechc_closer *closer, int k)
{
    const int last = --closer->active, n = job->unknowns, width = job->closure.width;
    if (k == last) return;
    closer->seeker[k] = closer->seeker[last];
    memcpy(closer->x + k * n, closer->x + last * n, (size_t)n * sizeof(double));
    memcpy(closer->step + k * n, closer->step + last * n, (size_t)n * sizeof(double));
    memcpy(closer->y + k * width, closer->y + last * width, (size_t)width * sizeof(double));
}

/* Evaluate one trial of every active start. */
static void mechc_close_round(mechc_closing *job, mechc_closer *closer)
{
    const mechc_closure *closure = &job->closure;
    mechc_ask(closure, MECHC_GAPS, closer->active, closer->y, closer->p, closer->gaps);
    mechc_ask(closure, MECHC_GRADIENT, closer->active, closer->y, closer->p, closer->gradients);
    mechc_measure_weigh(&closer->measure, closer->active, closer->gaps, closer->gradients);
    for (int k = closer->active - 1; k >= 0; k--) {
        if (mechc_close_take(job, closer, k)) continue;
        if (!closer->active) return;
        if (!mechc_close_begin(job, closer, k)) mechc_close_remove(job, closer, k);
    }
}
