/* The branch of a near miss on which a configuration is.
 *
 * Beside q* the gap along w is g + x.Q x / 2 to second order, x the move from q* that the other rows
 * allow.  Where it vanishes is a hyperbola: of Q's two eigenvalues one, a, has the sign of -g, and
 * along its eigenvector e no configuration is nearer than sqrt(-2 g / a).  So the sign of e.x tells
 * the two branches apart, whatever happened on the way: a step's directions may follow each other
 * smoothly and yet lead from one branch to the other.  No kinematics are needed: e.x = e.J^T w / a.
 */
#pragma once

#include "singularities/span.h"

#if MECHC_NH_MAX > 0
/* The two eigenvalues of Q that are not zero, and their vectors; the first separates the branches. */
typedef struct {
    double value[2], vector[2][MECHC_NU_MAX];
} mechc_hyperbola;

/* How much of the second-order terms those of higher order may be where branches are told apart. */
#define MECHC_HIGHER_TERMS 0.2

/* Second-order terms of so many units of rounding tell the sides of q* apart. */
#define MECHC_BY_ROUNDING 100.0

/* The eigenvector of a form of rank 2 whose other eigenvalue is given: the largest column of
 * Q (Q - other).  0 where there is none. */
MECHC_STATIC int mechc_vector_of_form(const double *form, double other, double *vector)
{
    double largest = 0.0;
    for (int j = 0; j < MECHC_NU; j++) {
        double column[MECHC_NU_MAX], square;
        for (int i = 0; i < MECHC_NU; i++)
            column[i] = mechc_dot(form + i * MECHC_NU, form + j * MECHC_NU, MECHC_NU)
                      - other * form[j * MECHC_NU + i];
        square = mechc_dot(column, column, MECHC_NU);
        if (!(square > largest)) continue;
        largest = square;
        for (int i = 0; i < MECHC_NU; i++) vector[i] = column[i] / sqrt(square);
    }
    return largest > 0.0;
}

/* The hyperbola at a near miss; 0 where curves do not pass each other there. */
MECHC_STATIC int mechc_hyperbola_at(double t, const mechc_scalar_given *given,
                                    const mechc_critical *c, mechc_hyperbola *out)
{
    double form[MECHC_NU_MAX * MECHC_NU_MAX], trace = 0.0, square = 0.0;
    mechc_second_form(t, given, c, form);
    for (int i = 0; i < MECHC_NU; i++) {
        trace += form[i * MECHC_NU + i];
        for (int j = 0; j <= i; j++) {
            const double mean = 0.5 * (form[i * MECHC_NU + j] + form[j * MECHC_NU + i]);
            form[i * MECHC_NU + j] = form[j * MECHC_NU + i] = mean;
            square += (i == j ? 1.0 : 2.0) * mean * mean;
        }
    }
    const double apart = sqrt(mechc_max(0.5 * square - 0.25 * trace * trace, 0.0));
    const double side = c->gap > 0.0 ? -1.0 : 1.0;
    out->value[0] = 0.5 * trace + side * apart;
    out->value[1] = 0.5 * trace - side * apart;
    return out->value[0] * out->value[1] < 0.0
        && mechc_vector_of_form(form, out->value[1], out->vector[0])
        && mechc_vector_of_form(form, out->value[0], out->vector[1]);
}

/* The components of x along the two vectors, times their values; 0 if q is off the hyperbola by
 * more than higher terms allow, or so near q* that rounding decides. */
MECHC_STATIC int mechc_along_vectors(double t, const double *q, const mechc_scalar_given *given,
                                     const mechc_critical *c, const mechc_hyperbola *at,
                                     double *along)
{
    double pull[MECHC_NU_MAX], part[2];
    mechc_pull(t, q, given, 0, 0.0, c->normal, pull);
    for (int j = 0; j < MECHC_NU; j++) pull[j] /= c->speeds[j];
    for (int k = 0; k < 2; k++) {
        along[k] = mechc_dot(pull, at->vector[k], MECHC_NU);
        part[k] = mechc_squared(along[k]) / at->value[k];
    }
    const double off = fabs(part[0] + part[1] + 2.0 * c->gap), size = fabs(part[0]) + fabs(part[1]);
    return off <= MECHC_HIGHER_TERMS * size && size > MECHC_BY_ROUNDING * c->rounding;
}

/* Whether the step leads from one branch to another.  At a near miss the first component tells them
 * apart.  At a change point the curves are lines: on the other side of q* both components of x have
 * changed their signs, on another branch one of them. */
MECHC_STATIC int mechc_changes_branch(const mechc_span *span, const mechc_critical *c)
{
    const mechc_path *path = span->path;
    const int lines = mechc_judge(c) == MECHC_CROSSING;
    mechc_hyperbola at;
    double along[2], before[2] = {0.0, 0.0};
    if (!mechc_hyperbola_at(span->t, span->given, c, &at)) return 0;
    for (int i = 0; i < path->count && !mechc_scalar_stopped(span->given); i++) {
        const double t = span->t + path->fraction[i] * span->h;
        if (path->open[i] || !mechc_along_vectors(t, path->q[i], span->given, c, &at, along))
            continue;
        const int second = lines && along[1] * before[1] < 0.0;
        if ((along[0] * before[0] < 0.0) != second) return 1;
        memcpy(before, along, sizeof before);
    }
    return 0;
}
#endif
