/* One assembly of each member, followed through a range of one coordinate.
 *
 * Steps along the coordinate are predicted by the tangent (cubic from two states) and corrected by
 * Newton's method on as many independent rows as there are unknowns.  A step is halved unless the
 * tangent turns little in it.  The sign of the rows' determinant changes where the curve of
 * configurations crosses itself: such a step is taken only if it is tiny, so that a curve that
 * turns back or aside beside a crossing is followed and not left.
 */
#pragma once

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "closing/measure.h"

#define MECHC_FOLLOW_ITERATIONS 8
#define MECHC_FOLLOW_FAR 0.2    /* rad or lengths: the largest correction of a step */
#define MECHC_FOLLOW_TURN 0.95  /* the least cosine between the tangents at its ends */
#define MECHC_FOLLOW_STRETCH 4.0 /* steps that a cubic is extrapolated over */
#define MECHC_FOLLOW_TINY 2e-6  /* rad or lengths: a step that may pass a change point */
/* Rounding enters a slope beside a crossing over the square of the distance, a cubic through two
 * places errs by its fourth power: both are least at the sixth root of the rounding. */
#define MECHC_FOLLOW_ASIDE 2.5e-3 /* rad or lengths */
#define MECHC_FOLLOW_LEAST 1e-13 /* a shorter step ends at a limit */
#define MECHC_FOLLOW_SINGULAR 1e-6 /* pivots, of the largest, at which nothing begins */
#define MECHC_FOLLOW_STEPS 2000 /* between two values asked for */

typedef struct {
    mechc_closure closure;
    int driven, unknowns;
    const int *unknown; /* and the driven coordinate last */
    ptrdiff_t count, values;
    const double *value; /* (values,), monotone */
    const double *p, *length; /* (count,): where the search for the length begins */
    double *q;     /* (count, values, coordinates): in, the first one, closed; out, all */
    double *ratio; /* likewise: derivatives by the driven coordinate */
    int most;      /* change points kept of a member */
    double *change_point; /* (count, most): values of the driven coordinate */
    int *passed;          /* (count,): how many; may exceed `most` */
    double *end;          /* (count,): where the assembly ends, NaN where it does not */
    ptrdiff_t next, done;
    int stop;
} mechc_following;

/* A state on the curve: coordinates, their derivatives by the driven one, sign of the determinant. */
typedef struct {
    double s, *q, *slope;
    double sign, weakest; /* the smallest pivot, of the largest */
} mechc_follow_place;

typedef struct {
    mechc_follow_place at, before, trial; /* `before`: where a step earlier it was; s NaN: nowhere */
    mechc_follow_place low, high;         /* on both sides of a crossing */
    double *y, *gap, *gradient, *matrix, *right;
    int *row; /* independent rows of the gradient */
    const double *p;
    mechc_measure measure;
    double *memory;
} mechc_follower;

static int mechc_follower_make(const mechc_following *job, mechc_follower *one)
{
    const size_t n = (size_t)job->unknowns, nq = (size_t)job->closure.coordinates;
    const size_t gap = (size_t)job->closure.breadth[MECHC_GAPS];
    const size_t gradient = (size_t)job->closure.breadth[MECHC_GRADIENT];
    const size_t matrix = (size_t)job->closure.rows * n;
    double *next = one->memory =
        calloc(10 * nq + (size_t)job->closure.width + gap + gradient + matrix + 2 * n + gap + 1,
               sizeof(double));
    one->row = calloc((size_t)job->closure.rows + 1, sizeof(int));
    if (!next || !one->row
        || !mechc_measure_make(&one->measure, &job->closure, job->unknowns + 1, job->unknown))
        return 0;
    mechc_follow_place *places[] = {&one->at, &one->before, &one->trial, &one->low, &one->high};
    for (int i = 0; i < 5; i++) {
        places[i]->q = next, next += nq;
        places[i]->slope = next, next += nq;
    }
    one->y = next, next += job->closure.width;
    one->gap = next, next += gap;
    one->gradient = next, next += gradient;
    one->matrix = next, next += matrix;
    one->right = next;
    return 1;
}

/* The unit of an unknown's step; the driven coordinate comes after the last unknown. */
static double mechc_follow_unit(const mechc_following *job, const mechc_follower *one, int i)
{
    return job->closure.kind[job->unknown[i]] == MECHC_TRANSLATION ? one->measure.length : 1.0;
}

/* Evaluate gap and gradient at a place. */
static void mechc_follow_ask(const mechc_following *job, mechc_follower *one,
                             const mechc_follow_place *place)
{
    memcpy(one->y, place->q, (size_t)job->closure.coordinates * sizeof(double));
    one->y[job->driven] = place->s;
    mechc_ask(&job->closure, MECHC_GAPS, 1, one->y, one->p, one->gap);
    mechc_ask(&job->closure, MECHC_GRADIENT, 1, one->y, one->p, one->gradient);
    mechc_measure_weigh(&one->measure, 1, one->gap, one->gradient);
}

/* Solve the chosen rows of the gradient over the unknowns for the right side, in place.  With
 * `choose`, independent rows are chosen first.  Returns the sign of the determinant, 0 where it is
 * singular; weakest: the smallest pivot, of the largest. */
static double mechc_follow_solve(const mechc_following *job, mechc_follower *one, int choose,
                                 double *weakest)
{
    const int n = job->unknowns, rows = choose ? job->closure.rows : n;
    double *a = one->matrix, *b = one->right, sign = 1.0, most = 0.0, least = HUGE_VAL;
    for (int i = 0; i < rows; i++) {
        const int row = choose ? i : one->row[i];
        if (choose) one->row[i] = i;
        for (int k = 0; k < n; k++)
            a[i * n + k] = one->gradient[row * job->closure.columns + job->unknown[k]]
                         * mechc_follow_unit(job, one, k);
    }
    for (int k = 0; k < n; k++) {
        int best = k;
        for (int i = k + 1; i < rows; i++)
            if (fabs(a[i * n + k]) > fabs(a[best * n + k])) best = i;
        const double pivot = a[best * n + k];
        most = fmax(most, fabs(pivot));
        least = fmin(least, fabs(pivot));
        if (!(fabs(pivot) > 0.0)) return 0.0;
        if (best != k) {
            const int row = one->row[k];
            mechc_close_swap(a + k * n, a + best * n, n);
            mechc_close_swap(b + k, b + best, 1);
            if (choose) one->row[k] = one->row[best], one->row[best] = row;
            sign = -sign;
        }
        if (pivot < 0.0) sign = -sign;
        for (int i = k + 1; i < rows; i++) {
            const double share = a[i * n + k] / pivot;
            if (share == 0.0) continue;
            for (int j = k + 1; j < n; j++) a[i * n + j] -= share * a[k * n + j];
            b[i] -= share * b[k];
        }
    }
    for (int k = n - 1; k >= 0; k--) {
        for (int j = k + 1; j < n; j++) b[k] -= a[k * n + j] * b[j];
        b[k] /= a[k * n + k];
    }
    *weakest = least / most;
    return sign;
}

/* The tangent at a place whose gradient is known; 0 if it is singular. */
static int mechc_follow_tangent(const mechc_following *job, mechc_follower *one,
                                mechc_follow_place *place, int choose)
{
    const int rows = choose ? job->closure.rows : job->unknowns;
    for (int i = 0; i < rows; i++) {
        const int row = choose ? i : one->row[i];
        one->right[i] = -one->gradient[row * job->closure.columns + job->driven];
    }
    place->sign = mechc_follow_solve(job, one, choose, &place->weakest);
    if (place->sign == 0.0) return 0;
    memset(place->slope, 0, (size_t)job->closure.coordinates * sizeof(double));
    for (int k = 0; k < job->unknowns; k++)
        place->slope[job->unknown[k]] = one->right[k] * mechc_follow_unit(job, one, k);
    place->slope[job->driven] = 1.0;
    return 1;
}

/* Newton's method at the trial's value of the driven coordinate; whether it closes the loops near
 * the prediction. */
static int mechc_follow_correct(const mechc_following *job, mechc_follower *one)
{
    mechc_follow_place *trial = &one->trial;
    const double rounding = DBL_EPSILON * one->measure.size;
    double before = HUGE_VAL, moved = 0.0, weakest;
    for (int iteration = 0; iteration < MECHC_FOLLOW_ITERATIONS; iteration++) {
        mechc_follow_ask(job, one, trial);
        const double size = sqrt(mechc_square(one->gap, job->closure.breadth[MECHC_GAPS]));
        if (!(size < HUGE_VAL)) return 0;
        if (size <= 4.0 * rounding || (iteration && !(size < 0.5 * before)))
            return size <= MECHC_CLOSED * rounding;
        before = size;
        for (int i = 0; i < job->unknowns; i++) one->right[i] = -one->gap[one->row[i]];
        if (mechc_follow_solve(job, one, 0, &weakest) == 0.0) return 0;
        double furthest = 0.0;
        for (int k = 0; k < job->unknowns; k++) {
            trial->q[job->unknown[k]] += one->right[k] * mechc_follow_unit(job, one, k);
            furthest = fmax(furthest, fabs(one->right[k]));
        }
        moved += furthest;
        if (!(moved <= MECHC_FOLLOW_FAR)) return 0;
    }
    return 0;
}

/* q and, where wanted, its slope at a value of the driven coordinate, by the cubic through two
 * places; by the tangent where there is one place only. */
static void mechc_follow_cubic(const mechc_following *job, const mechc_follow_place *a,
                               const mechc_follow_place *b, double s, double *q, double *slope)
{
    const double width = b->s - a->s, x = s - b->s, z = x / width;
    const int cubic = fabs(z) <= MECHC_FOLLOW_STRETCH;
    for (int i = 0; i < job->closure.coordinates; i++) {
        double second = 0.0, third = 0.0;
        if (cubic) { /* q = b + b' x + second z^2 + third z^3, of the place before z = -1 */
            const double rise = a->q[i] - b->q[i] + b->slope[i] * width;
            const double bend = (a->slope[i] - b->slope[i]) * width;
            second = 3.0 * rise + bend;
            third = 2.0 * rise + bend;
        }
        const double scaled = cubic ? z : 0.0;
        q[i] = b->q[i] + b->slope[i] * x + scaled * scaled * (second + scaled * third);
        if (slope)
            slope[i] = b->slope[i]
                     + (cubic ? scaled * (2.0 * second + 3.0 * scaled * third) / width : 0.0);
    }
}

/* The cosine of the angle between the tangents at a place and at the trial. */
static double mechc_follow_cosine(const mechc_following *job, const mechc_follower *one,
                                  const mechc_follow_place *from)
{
    const double *a = from->slope, *b = one->trial.slope;
    const double driven = mechc_follow_unit(job, one, job->unknowns);
    double both = 1.0 / (driven * driven), first = both, second = both;
    for (int k = 0; k < job->unknowns; k++) {
        const double unit = mechc_follow_unit(job, one, k), square = unit * unit;
        const int i = job->unknown[k];
        both += a[i] * b[i] / square;
        first += a[i] * a[i] / square;
        second += b[i] * b[i] / square;
    }
    return both / sqrt(first * second);
}

/* Compute the tangent at the place reached, by rows that are independent there. */
static int mechc_follow_arrive(const mechc_following *job, mechc_follower *one)
{
    mechc_follow_ask(job, one, &one->at);
    return (job->closure.rows == job->unknowns || mechc_follow_tangent(job, one, &one->at, 1))
        && mechc_follow_tangent(job, one, &one->at, 0);
}

/* Try the step to s; 1: taken, 2: taken through a change point, 0: refused. */
static int mechc_follow_step(const mechc_following *job, mechc_follower *one, double s)
{
    const double unit = mechc_follow_unit(job, one, job->unknowns);
    mechc_follow_place *trial = &one->trial;
    trial->s = s;
    mechc_follow_cubic(job, &one->before, &one->at, s, trial->q, NULL);
    if (!mechc_follow_correct(job, one) || !mechc_follow_tangent(job, one, trial, 0)) return 0;
    const int crossed = trial->sign != one->at.sign;
    if (crossed && fabs(s - one->at.s) > MECHC_FOLLOW_TINY * unit) return 0;
    if (!(mechc_follow_cosine(job, one, &one->at) >= MECHC_FOLLOW_TURN)) return 0;
    const mechc_follow_place before = one->before;
    one->before = one->at;
    one->at = one->trial;
    one->trial = before;
    if (job->closure.rows != job->unknowns && !mechc_follow_arrive(job, one)) return 0;
    return 1 + crossed;
}

/* Follow the curve to a value of the driven coordinate, or a little beyond it at a change point; 0:
 * the assembly ends before it. */
static int mechc_follow_to(mechc_following *job, mechc_follower *one, ptrdiff_t member,
                           double target)
{
    const double unit = mechc_follow_unit(job, one, job->unknowns);
    const double side = job->value[job->values - 1] >= job->value[0] ? 1.0 : -1.0;
    double step = target - one->at.s;
    for (int count = 0; count < MECHC_FOLLOW_STEPS; count++) {
        const double left = target - one->at.s;
        if (side * left <= 0.0) return 1;
        const int last = fabs(step) >= fabs(left);
        int taken = mechc_follow_step(job, one, last ? target : one->at.s + step);
        if (!taken && last && fabs(left) <= 0.5 * MECHC_FOLLOW_TINY * unit)
            taken = mechc_follow_step(job, one, one->at.s + 2.0 * left);
        if (taken == 2 && job->passed[member]++ < job->most)
            job->change_point[member * job->most + job->passed[member] - 1] =
                0.5 * (one->before.s + one->at.s);
        if (last && !taken) step = left;
        step *= taken ? 2.0 : 0.5;
        if (!taken && fabs(step) < MECHC_FOLLOW_LEAST * fmax(unit, fabs(target))) return 0;
    }
    return 0;
}

/* A place of the curve at a distance from a place beside a crossing, on the same side; 0: none was found. */
static int mechc_follow_aside(const mechc_following *job, mechc_follower *one,
                              mechc_follow_place *from, double distance,
                              mechc_follow_place *found)
{
    mechc_follow_place *trial = &one->trial;
    mechc_follow_ask(job, one, from);
    if (!mechc_follow_tangent(job, one, from, 0)) return 0; /* its sign, by the rows of now */
    trial->s = from->s + distance;
    mechc_follow_cubic(job, from, from, trial->s, trial->q, NULL);
    if (!mechc_follow_correct(job, one) || !mechc_follow_tangent(job, one, trial, 0)) return 0;
    if (trial->sign != from->sign) return 0;
    if (!(mechc_follow_cosine(job, one, from) >= MECHC_FOLLOW_TURN)) return 0;
    const mechc_follow_place unused = *found;
    *found = *trial;
    *trial = unused;
    return 1;
}

/* q and its slope at a crossing between the last two places, from places farther aside if the curve
 * goes on there. */
static void mechc_follow_at_crossing(const mechc_following *job, mechc_follower *one, double s,
                                     double *q, double *slope)
{
    const double far = MECHC_FOLLOW_ASIDE * mechc_follow_unit(job, one, job->unknowns);
    const double distance = one->at.s > one->before.s ? far : -far;
    const int aside = mechc_follow_aside(job, one, &one->before, -distance, &one->low)
                   && mechc_follow_aside(job, one, &one->at, distance, &one->high);
    mechc_follow_cubic(job, aside ? &one->low : &one->before, aside ? &one->high : &one->at, s, q,
                       slope);
}

static int mechc_follow_stopped(const mechc_following *job)
{
    return __atomic_load_n(&job->stop, __ATOMIC_RELAXED);
}

static void mechc_follow_member(mechc_following *job, mechc_follower *one, ptrdiff_t member)
{
    const int nq = job->closure.coordinates;
    const size_t row = (size_t)nq * sizeof(double);
    double *q = job->q + member * job->values * nq, *ratio = job->ratio + member * job->values * nq;
    int goes_on;
    one->p = job->p + member * job->closure.parameters;
    mechc_measure_member(&one->measure, q, one->p, job->length[member]);
    job->passed[member] = 0;
    job->end[member] = NAN;
    memset(one->y, 0, (size_t)job->closure.width * sizeof(double));
    memcpy(one->at.q, q, row);
    one->at.s = job->value[0];
    one->before.s = NAN;
    for (int i = 0; i < job->closure.rows; i++) one->row[i] = i;
    goes_on = q[0] == q[0] && mechc_follow_arrive(job, one)
           && one->at.weakest > MECHC_FOLLOW_SINGULAR;
    if (goes_on) memcpy(ratio, one->at.slope, row);
    for (ptrdiff_t i = 1; i < job->values && !mechc_follow_stopped(job); i++) {
        const double target = job->value[i];
        goes_on = goes_on && mechc_follow_to(job, one, member, target);
        for (int k = 0; k < nq; k++) q[i * nq + k] = ratio[i * nq + k] = NAN;
        if (!goes_on) continue;
        if (one->at.s == target) {
            memcpy(q + i * nq, one->at.q, row);
            memcpy(ratio + i * nq, one->at.slope, row);
        } else {
            mechc_follow_at_crossing(job, one, target, q + i * nq, ratio + i * nq);
        }
        q[i * nq + job->driven] = target;
    }
    if (!goes_on) job->end[member] = one->at.s;
}

/* Follow the curves of members until none is left; any number of threads; 0 without memory. */
static int mechc_follow_work(mechc_following *job)
{
    mechc_follower one = {0};
    const int made = mechc_follower_make(job, &one);
    while (made && !mechc_follow_stopped(job)) {
        const ptrdiff_t member = __atomic_fetch_add(&job->next, 1, __ATOMIC_RELAXED);
        if (member >= job->count) break;
        mechc_follow_member(job, &one, member);
        __atomic_fetch_add(&job->done, 1, __ATOMIC_RELAXED);
    }
    free(one.memory);
    free(one.row);
    mechc_measure_free(&one.measure);
    return made;
}
