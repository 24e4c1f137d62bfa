/* Every configuration that closes the loops, member by member, from the same starts.
 *
 * Levenberg-Marquardt with the damping of Yamashita & Fukushima (2001).  Close to a solution steps
 * go on while they close the loops further: where two assemblies meet each gains a bit.
 */
#pragma once

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "abi/model.h"

#define MECHC_CLOSE_ITERATIONS 60
#define MECHC_CLOSE_POLISHES 40
#define MECHC_CLOSE_SAME 1e-6

typedef struct {
    const mechc_unit *unit;
    int gap_output, gradient_output; /* indices of the outputs that give them */
    int gap_width, rows, columns;    /* of the gradient; the first `rows` count */
    int coordinates, width, parameters, unknowns;
    const int *unknown;
    const unsigned char *angular; /* an unknown each */
    double t;
    ptrdiff_t starts;
    const double *start; /* in radians, or in the model's length */
    ptrdiff_t count, block;
    const double *fixed; /* a row of coordinates a member; the unknowns are not looked at */
    const double *p, *length;
    int most;
    double *found; /* (count, most, coordinates) */
    int *many;     /* how many were found; may exceed `most` */
    double *miss;  /* the least gap met, m */
    ptrdiff_t next, done;
    int stop;
} mechc_closing;

/* Starts are worked on side by side, so that the outputs come from full lanes; where one is done
 * the next takes its place. */
#define MECHC_CLOSE_TEAM 8

typedef struct {
    double *y;                       /* states, a row a start */
    double *gaps, *gradients, *kept; /* outputs, likewise; kept: the gap at x */
    double *x, *step, *square;
    double size[MECHC_CLOSE_TEAM], before[MECHC_CLOSE_TEAM];
    int steps[MECHC_CLOSE_TEAM]; /* taken from this start; -1: none is at work here */
    const double *p;
    double length;
} mechc_closer;

static int mechc_closer_make(const mechc_closing *job, mechc_closer *closer)
{
    const size_t n = (size_t)job->unknowns, one = sizeof(double), team = MECHC_CLOSE_TEAM;
    const size_t gap = (size_t)job->gap_width;
    closer->y = calloc(team * (size_t)job->width, one);
    closer->gaps = malloc(team * gap * one);
    closer->kept = malloc(team * gap * one);
    closer->gradients =
        malloc(team * (size_t)job->unit->outputs[job->gradient_output].width * one);
    closer->x = malloc(team * n * one);
    closer->step = malloc(team * n * one);
    closer->square = malloc(n * n * one);
    return closer->y && closer->gaps && closer->kept && closer->gradients && closer->x
        && closer->step && closer->square;
}

static void mechc_closer_free(mechc_closer *closer)
{
    free(closer->y);
    free(closer->gaps);
    free(closer->kept);
    free(closer->gradients);
    free(closer->x);
    free(closer->step);
    free(closer->square);
}

static double mechc_close_unit(const mechc_closing *job, const mechc_closer *closer, int i)
{
    return job->angular[i] ? 1.0 : closer->length;
}

/* An output of the whole team at x - factor * step. */
static void mechc_close_evaluate(const mechc_closing *job, mechc_closer *closer, int output,
                                 double factor, double *out)
{
    const mechc_rows t = {&job->t, 0}, y = {closer->y, job->width}, p = {closer->p, 0};
    for (int k = 0; k < MECHC_CLOSE_TEAM; k++)
        for (int i = 0; i < job->unknowns; i++) {
            const int at = k * job->unknowns + i;
            const double change = factor != 0.0 ? factor * closer->step[at] : 0.0;
            closer->y[k * job->width + job->unknown[i]] =
                closer->x[at] - change * mechc_close_unit(job, closer, i);
        }
    job->unit->outputs[output].evaluate(MECHC_CLOSE_TEAM, t, y, p, NULL, out);
}

static double mechc_close_norm(const double *values, int count)
{
    double square = 0.0;
    for (int i = 0; i < count; i++) square += values[i] * values[i];
    return sqrt(square);
}

/* Solve (G'G + damping) step = G'gap of one start by Cholesky, in units of the scale; the step is
 * at most 0.7 long. */
static inline __attribute__((always_inline)) void
mechc_close_solve_sized(const mechc_closing *job, mechc_closer *closer, int k, double damping,
                        int n, int rows)
{
    const double *gradient =
        closer->gradients + k * job->unit->outputs[job->gradient_output].width;
    const double *gap = closer->kept + k * job->gap_width;
    double *a = closer->square, *b = closer->step + k * n, trace = 0.0, longest = 0.0;
    for (int i = 0; i < n; i++) {
        b[i] = 0.0;
        for (int r = 0; r < rows; r++)
            b[i] += gradient[r * job->columns + job->unknown[i]] * gap[r];
        b[i] *= mechc_close_unit(job, closer, i);
        for (int j = 0; j <= i; j++) {
            double sum = 0.0;
            for (int r = 0; r < rows; r++)
                sum += gradient[r * job->columns + job->unknown[i]]
                     * gradient[r * job->columns + job->unknown[j]];
            a[i * n + j] =
                sum * mechc_close_unit(job, closer, i) * mechc_close_unit(job, closer, j);
        }
        trace += a[i * n + i];
    }
    for (int i = 0; i < n; i++) a[i * n + i] += (damping + 1e-14) * trace + 1e-300;
    for (int i = 0; i < n; i++) {
        for (int j = 0; j <= i; j++) {
            double sum = a[i * n + j];
            for (int m = 0; m < j; m++) sum -= a[i * n + m] * a[j * n + m];
            a[i * n + j] = i == j ? sqrt(fmax(sum, 1e-300)) : sum / a[j * n + j];
        }
        for (int m = 0; m < i; m++) b[i] -= a[i * n + m] * b[m];
        b[i] /= a[i * n + i];
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int m = i + 1; m < n; m++) b[i] -= a[m * n + i] * b[m];
        b[i] /= a[i * n + i];
        longest = fmax(longest, fabs(b[i]));
    }
    for (int i = 0; i < n; i++)
        b[i] = !(longest < HUGE_VAL) ? 0.0 : longest > 0.7 ? b[i] * 0.7 / longest : b[i];
}

static void mechc_close_solve(const mechc_closing *job, mechc_closer *closer, int k,
                              double damping)
{
    if (job->unknowns == 2 && job->rows == 2) /* one planar loop: sizes the compiler knows */
        mechc_close_solve_sized(job, closer, k, damping, 2, 2);
    else
        mechc_close_solve_sized(job, closer, k, damping, job->unknowns, job->rows);
}

/* One step of every start at work, cut until it lowers the gap; a start that is new has its gap
 * looked at. */
static void mechc_close_descend(const mechc_closing *job, mechc_closer *closer)
{
    int open[MECHC_CLOSE_TEAM], left = 0;
    const int n = job->unknowns, width = job->gap_width;
    mechc_close_evaluate(job, closer, job->gradient_output, 0.0, closer->gradients);
    memset(closer->step, 0, (size_t)(MECHC_CLOSE_TEAM * n) * sizeof(double));
    for (int k = 0; k < MECHC_CLOSE_TEAM; k++) {
        const double relative = closer->size[k] / closer->length;
        open[k] = closer->steps[k] >= 0;
        left += open[k];
        if (closer->steps[k] > 0) mechc_close_solve(job, closer, k, relative * relative);
    }
    for (double factor = 1.0; left && factor > 0.05; factor *= 0.25) {
        mechc_close_evaluate(job, closer, job->gap_output, factor, closer->gaps);
        for (int k = 0; k < MECHC_CLOSE_TEAM; k++) {
            const double after = mechc_close_norm(closer->gaps + k * width, width);
            if (!open[k] || !(after < closer->size[k])) continue;
            for (int i = 0; i < n; i++)
                closer->x[k * n + i] = closer->y[k * job->width + job->unknown[i]];
            memcpy(closer->kept + k * width, closer->gaps + k * width,
                   (size_t)width * sizeof(double));
            closer->size[k] = after;
            open[k] = 0;
            left--;
        }
    }
    for (int k = 0; k < MECHC_CLOSE_TEAM; k++) closer->steps[k] += closer->steps[k] >= 0;
}

/* Whether a start has come to where it leads: closed to rounding, or no longer gaining. */
static int mechc_close_arrived(const mechc_closer *closer, int k)
{
    const double size = closer->size[k], before = closer->before[k];
    const int near = size <= 1e-3 * closer->length;
    const int most = MECHC_CLOSE_ITERATIONS + (near ? MECHC_CLOSE_POLISHES : 0);
    if (closer->steps[k] == 0) return 0;
    /* far off, it has found the least gap; close by, it stalls only at rounding */
    return size <= 2.0 * DBL_EPSILON * closer->length || closer->steps[k] > most
        || !(near ? size < before : size <= 0.999 * before);
}

/* Put the next start of the list, if there is one, in place k. */
static void mechc_close_begin(const mechc_closing *job, mechc_closer *closer, int k,
                              ptrdiff_t start)
{
    closer->steps[k] = start < job->starts ? 0 : -1;
    closer->size[k] = closer->before[k] = HUGE_VAL;
    if (start >= job->starts) return;
    for (int i = 0; i < job->unknowns; i++)
        closer->x[k * job->unknowns + i] =
            job->start[start * job->unknowns + i] * mechc_close_unit(job, closer, i);
}

static double mechc_close_wrap(double angle)
{
    const double turn = 6.283185307179586, left = fmod(3.141592653589793 - angle, turn);
    return 3.141592653589793 - (left < 0.0 ? left + turn : left);
}

/* Keep where start k of the team led to, unless it is known. */
static void mechc_close_keep(mechc_closing *job, mechc_closer *closer, ptrdiff_t member, int k)
{
    double *y = closer->y + k * job->width;
    double *found = job->found + member * job->most * job->coordinates;
    const int many = job->many[member] < job->most ? job->many[member] : job->most;
    for (int i = 0; i < job->unknowns; i++) {
        const double x = closer->x[k * job->unknowns + i];
        y[job->unknown[i]] = job->angular[i] ? mechc_close_wrap(x) : x;
    }
    for (int other = 0; other < many; other++) {
        double away = 0.0;
        for (int i = 0; i < job->unknowns; i++) {
            const double change = y[job->unknown[i]]
                                - found[other * job->coordinates + job->unknown[i]];
            away = fmax(away, job->angular[i] ? fabs(mechc_close_wrap(change))
                                              : fabs(change) / closer->length);
        }
        if (away <= MECHC_CLOSE_SAME) return;
    }
    if (many < job->most)
        memcpy(found + many * job->coordinates, y,
               (size_t)job->coordinates * sizeof(double));
    job->many[member]++;
}

static void mechc_close_member(mechc_closing *job, mechc_closer *closer, ptrdiff_t member)
{
    closer->p = job->p + member * job->parameters;
    closer->length = job->length[member];
    for (int k = 0; k < MECHC_CLOSE_TEAM; k++)
        memcpy(closer->y + k * job->width, job->fixed + member * job->coordinates,
               (size_t)job->coordinates * sizeof(double));
    job->many[member] = 0;
    job->miss[member] = HUGE_VAL;
    memset(closer->x, 0, (size_t)(MECHC_CLOSE_TEAM * job->unknowns) * sizeof(double));
    ptrdiff_t next = 0, left = job->starts;
    for (int k = 0; k < MECHC_CLOSE_TEAM; k++) mechc_close_begin(job, closer, k, next++);
    while (left > 0) {
        mechc_close_descend(job, closer);
        for (int k = 0; k < MECHC_CLOSE_TEAM; k++) {
            if (closer->steps[k] < 0) continue;
            if (mechc_close_arrived(closer, k)) {
                job->miss[member] = fmin(job->miss[member], closer->size[k]);
                if (closer->size[k] <= 64.0 * DBL_EPSILON * closer->length)
                    mechc_close_keep(job, closer, member, k);
                mechc_close_begin(job, closer, k, next++);
                left--;
            } else {
                closer->before[k] = closer->size[k];
            }
        }
    }
}

static int mechc_close_work(mechc_closing *job)
{
    mechc_closer closer = {0};
    const int made = mechc_closer_make(job, &closer);
    while (made) {
        const ptrdiff_t first = __atomic_fetch_add(&job->next, job->block, __ATOMIC_RELAXED);
        if (first >= job->count) break;
        for (ptrdiff_t i = first; i < first + job->block && i < job->count; i++) {
            if (__atomic_load_n(&job->stop, __ATOMIC_RELAXED)) break;
            mechc_close_member(job, &closer, i);
            __atomic_fetch_add(&job->done, 1, __ATOMIC_RELAXED);
        }
    }
    mechc_closer_free(&closer);
    return made;
}
