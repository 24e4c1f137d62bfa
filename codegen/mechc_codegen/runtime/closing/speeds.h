/* Speeds that satisfy the constraints, state by state. */
#pragma once

#include <math.h>
#include <string.h>
#include <stdlib.h>
#include "closing/closure.h"
#include "closing/least_change.h"

typedef struct {
    mechc_closure closure;
    int rows, speeds;   /* of J */
    int unknowns;       /* speeds that may change */
    const int *unknown; /* their places among the speeds */
    double dead;        /* singular values below it, of the largest, count as zero */
    ptrdiff_t count, p_stride; /* 0: one set of parameters for all */
    const double *p;
    const double *weight; /* (count or 1, rows): by which rows are multiplied; NULL: by 1 */
    const double *step;   /* (count or 1, speeds): units of the speeds; NULL: 1 */
    double *y;            /* (count, width): the speeds are changed in place */
    double *left;         /* the largest residual that remains, of J's and the speeds' size */
    int *row;             /* the row that has it */
    double *residual;     /* its size, per second */
    double *conditioning; /* least singular value of J, of the largest */
    int stop;
} mechc_speeds_job;

/* The ratio of the least to the largest singular value of J; 0 if J has more rows than columns. */
static double mechc_speeds_conditioning(const mechc_speeds_job *job, const double *jacobian,
                                        double *copy, double *lengths)
{
    double least = HUGE_VAL;
    if (job->rows > job->speeds) return 0.0;
    memcpy(copy, jacobian, (size_t)(job->rows * job->speeds) * sizeof(double));
    mechc_orthogonal_rows(copy, NULL, job->rows, job->speeds, lengths);
    for (int i = 0; i < job->rows; i++) least = fmin(least, lengths[i]);
    return least / mechc_largest(lengths, job->rows);
}

static double mechc_speeds_weight(const mechc_speeds_job *job, ptrdiff_t state, int row)
{
    return job->weight ? job->weight[(job->p_stride ? state * job->rows : 0) + row] : 1.0;
}

static double mechc_speeds_step(const mechc_speeds_job *job, ptrdiff_t state, int speed)
{
    return job->step ? job->step[(job->p_stride ? state * job->speeds : 0) + speed] : 1.0;
}

/* Residuals and J, scaled by the units of rows and speeds. */
static void mechc_speeds_ask(const mechc_speeds_job *job, ptrdiff_t state, double *residuals,
                             double *jacobian)
{
    const double *y = job->y + state * job->closure.width, *p = job->p + state * job->p_stride;
    mechc_ask(&job->closure, MECHC_RESIDUALS, 1, y, p, residuals);
    if (jacobian) mechc_ask(&job->closure, MECHC_JACOBIAN, 1, y, p, jacobian);
    if (!job->weight) return;
    for (int i = 0; i < job->rows; i++) {
        const double weight = mechc_speeds_weight(job, state, i);
        residuals[i] *= weight;
        for (int k = 0; jacobian && k < job->speeds; k++)
            jacobian[i * job->speeds + k] *= weight * mechc_speeds_step(job, state, k);
    }
}

/* Report the remaining residuals, relative to the size of J and of the speeds. */
static void mechc_speeds_report(mechc_speeds_job *job, ptrdiff_t state, const double *residuals,
                                const double *jacobian)
{
    const double *u = job->y + state * job->closure.width + job->closure.coordinates;
    double fastest = 1.0;
    int worst = 0;
    for (int k = 0; k < job->speeds; k++)
        fastest = fmax(fastest, fabs(u[k]) / mechc_speeds_step(job, state, k));
    for (int i = 0; i < job->rows; i++) /* one that is no number is the worst */
        if (!(fabs(residuals[i]) <= fabs(residuals[worst]))) worst = i;
    const double size = mechc_largest(jacobian, job->rows * job->speeds) * fastest;
    job->row[state] = worst;
    job->residual[state] = fabs(residuals[worst]) / mechc_speeds_weight(job, state, worst);
    job->left[state] = residuals[worst] == 0.0 ? 0.0 : fabs(residuals[worst]) / size;
}

static void mechc_speeds_of(mechc_speeds_job *job, ptrdiff_t state, double *space)
{
    const int rows = job->rows, speeds = job->speeds;
    double *jacobian = space, *copy = jacobian + rows * speeds, *residuals = copy + rows * speeds;
    double *lengths = residuals + rows, *aim = lengths + rows, *change = aim + rows;
    double *y = job->y + state * job->closure.width, *u = y + job->closure.coordinates;
    mechc_speeds_ask(job, state, residuals, jacobian);
    job->conditioning[state] = mechc_speeds_conditioning(job, jacobian, copy, lengths);
    if (job->unknowns && mechc_largest(residuals, rows) > 0.0) {
        for (int i = 0; i < rows; i++)
            for (int k = 0; k < job->unknowns; k++)
                copy[i * job->unknowns + k] = jacobian[i * speeds + job->unknown[k]];
        memcpy(aim, residuals, (size_t)rows * sizeof(double));
        mechc_least_change(copy, aim, rows, job->unknowns, job->dead, lengths, change);
        for (int k = 0; k < job->unknowns; k++) {
            const int at = job->unknown[k];
            u[at] -= change[k] * mechc_speeds_step(job, state, at);
        }
        mechc_speeds_ask(job, state, residuals, NULL);
    }
    mechc_speeds_report(job, state, residuals, jacobian);
}

/* Compute the speeds of states until none is left; 0 without memory. */
static int mechc_speeds_work(mechc_speeds_job *job)
{
    const size_t matrix = (size_t)(job->rows * job->speeds), rows = (size_t)job->rows;
    /* for one state: J, a copy of it, residuals, change, singular values */
    double *space = malloc((2 * matrix + 3 * rows + (size_t)job->speeds + 1) * sizeof(double));
    if (!space) return 0;
    for (ptrdiff_t state = 0; state < job->count; state++) {
        if (__atomic_load_n(&job->stop, __ATOMIC_RELAXED)) break;
        mechc_speeds_of(job, state, space);
    }
    free(space);
    return 1;
}
