/* The sizes by which a search measures coordinates and rows, whatever their units are.
 *
 * A row may be a distance, its square or the cosine of an angle, in metres or millimetres, times any
 * number.  It is measured by what steps of the coordinates make of it, over configurations spread
 * evenly: a radian for an angle, 1 for a number, a length for all others.
 *
 * The length is found from the rows.  Far out the constants in a row do not show: by Euler's theorem
 * on homogeneous functions x . grad g = d g there.  The length is where that ceases to hold: about
 * the extent of the mechanism.
 */
#pragma once

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include "closing/closure.h"

#define MECHC_MEASURED 16        /* configurations */
#define MECHC_MEASURE_FAR 40.0   /* octaves from where the search for the length begins */
#define MECHC_MEASURE_STRIDE 3.0 /* octaves from one length tried to the next */
#define MECHC_MEASURE_LAG 0.25   /* of the degree, beyond which constants show */
#define MECHC_MEASURE_EVEN 0.01  /* by which degrees far out and nearer differ, of such a function */
#define MECHC_MEASURE_UNMOVED 1e-8 /* of what translations make of a row in the same unit */
#define MECHC_MEASURE_DEGREE 16.0 /* the largest; what grows faster is none */
#define MECHC_MEASURE_END 0.1    /* of the bracket: regula falsi is kept that far off its ends */
#define MECHC_CLOSED 64.0 /* units of rounding that gaps of closed configurations may have */
#define MECHC_MEASURE_LINKS 2.0  /* a chain of links reaches further than the row of one */

enum { MECHC_TRANSLATION, MECHC_ANGLE, MECHC_NUMBER }; /* kinds of coordinates */

typedef struct {
    const mechc_closure *closure;
    int unknowns;
    const int *unknown;
    double length;   /* the step of a coordinate that is neither angle nor number */
    double *weight;  /* (rows,): makes rows comparable */
    double size;     /* of all rows, so weighted: what steps change them by */
    int even;        /* whether all weights are 1 */
    double *spread, *y, *gap, *gradient, *degree;
    double *memory;
} mechc_measure;

/* Points spread evenly (Roberts 2018), the same for all members. */
static void mechc_measure_spread(mechc_measure *one)
{
    const int n = one->unknowns;
    double ratio = 2.0, step = 1.0;
    for (int i = 0; i < 12; i++) ratio = pow(1.0 + ratio, 1.0 / (n + 1));
    for (int i = 0; i < n; i++) {
        step /= ratio;
        for (int k = 0; k < MECHC_MEASURED; k++)
            one->spread[k * n + i] = 2.0 * fmod(0.5 + (k + 1) * step, 1.0) - 1.0;
    }
}

static int mechc_measure_make(mechc_measure *one, const mechc_closure *closure, int unknowns,
                              const int *unknown)
{
    const size_t width = (size_t)closure->width, rows = (size_t)closure->rows;
    const size_t gap = (size_t)closure->breadth[MECHC_GAPS];
    const size_t gradient = (size_t)closure->breadth[MECHC_GRADIENT];
    const size_t each = (size_t)unknowns + width + gap + gradient;
    double *next = one->memory = calloc(MECHC_MEASURED * each + 2 * rows, sizeof(double));
    if (!next) return 0;
    one->closure = closure;
    one->unknowns = unknowns;
    one->unknown = unknown;
    one->spread = next, next += MECHC_MEASURED * unknowns;
    one->y = next, next += MECHC_MEASURED * width;
    one->gap = next, next += MECHC_MEASURED * gap;
    one->gradient = next, next += MECHC_MEASURED * gradient;
    one->weight = next, next += rows;
    one->degree = next;
    mechc_measure_spread(one);
    return 1;
}

static void mechc_measure_free(mechc_measure *one) { free(one->memory); }

/* Gaps and gradients at configurations spread over a range of this length. */
static void mechc_measure_at(mechc_measure *one, const double *p, double length)
{
    const mechc_closure *closure = one->closure;
    static const double turn[] = {1.0, M_PI, 1.0};
    for (int k = 0; k < MECHC_MEASURED; k++)
        for (int i = 0; i < one->unknowns; i++) {
            const int at = one->unknown[i], kind = closure->kind[at];
            one->y[k * closure->width + at] = one->spread[k * one->unknowns + i] * turn[kind]
                                                * (kind == MECHC_TRANSLATION ? length : 1.0);
        }
    mechc_ask(closure, MECHC_GAPS, MECHC_MEASURED, one->y, p, one->gap);
    mechc_ask(closure, MECHC_GRADIENT, MECHC_MEASURED, one->y, p, one->gradient);
}

/* The degree with which a row grows with the translations, and how much; 0 if it contains none. */
static double mechc_measure_degree(const mechc_measure *one, int row, double *grown)
{
    const mechc_closure *closure = one->closure;
    double growth = 0.0, value = 0.0;
    for (int k = 0; k < MECHC_MEASURED; k++) {
        const double gap = one->gap[k * closure->breadth[MECHC_GAPS] + row];
        const double *gradient = one->gradient + k * closure->breadth[MECHC_GRADIENT]
                               + row * closure->columns;
        double along = 0.0;
        for (int i = 0; i < one->unknowns; i++)
            if (closure->kind[one->unknown[i]] == MECHC_TRANSLATION)
                along += gradient[one->unknown[i]] * one->y[k * closure->width + one->unknown[i]];
        growth += along * along;
        value += gap * gap;
    }
    *grown = sqrt(growth);
    return growth > 0.0 ? sqrt(growth / value) : 0.0;
}

/* The degrees of the rows far out; 0 for a row that is not a homogeneous function there, and for one on which
 * translations act by rounding alone: another in the same unit tells. */
static void mechc_measure_degrees(mechc_measure *one, const double *p, double hint)
{
    const double far = hint * exp2(MECHC_MEASURE_FAR);
    const int rows = one->closure->rows, *alike = one->closure->alike;
    double nearer_grown, *grown = one->weight; /* until rows are weighed */
    mechc_measure_at(one, p, far);
    for (int row = 0; row < rows; row++) one->degree[row] = mechc_measure_degree(one, row, grown + row);
    mechc_measure_at(one, p, far / exp2(MECHC_MEASURE_STRIDE));
    for (int row = 0; row < rows; row++) {
        const double nearer = mechc_measure_degree(one, row, &nearer_grown);
        if (!(fabs(nearer - one->degree[row]) < MECHC_MEASURE_EVEN && nearer < MECHC_MEASURE_DEGREE))
            one->degree[row] = 0.0;
        for (int other = 0; other < rows; other++)
            if (alike[other] == alike[row] && grown[row] < MECHC_MEASURE_UNMOVED * grown[other])
                one->degree[row] = 0.0;
    }
}

/* The relative difference between the degrees at this length and those far out, beyond what is allowed. */
static double mechc_measure_lag(mechc_measure *one, const double *p, double length)
{
    double lag = -1.0, grown;
    mechc_measure_at(one, p, length);
    for (int row = 0; row < one->closure->rows; row++)
        if (one->degree[row] > 0.0)
            lag = fmax(lag, 1.0 - mechc_measure_degree(one, row, &grown) / one->degree[row]);
    return lag - MECHC_MEASURE_LAG;
}

/* The length beyond which constants no longer matter; the hint if the rows contain none. */
static double mechc_measure_length(mechc_measure *one, const double *p, double hint)
{
    double low = 0.0, lag_low, high, lag_high; /* octaves */
    mechc_measure_degrees(one, p, hint);
    lag_low = mechc_measure_lag(one, p, hint);
    high = low, lag_high = lag_low;
    while (lag_high > 0.0 && high < MECHC_MEASURE_FAR - MECHC_MEASURE_STRIDE) {
        low = high, lag_low = lag_high;
        high += MECHC_MEASURE_STRIDE;
        lag_high = mechc_measure_lag(one, p, hint * exp2(high));
    }
    while (!(lag_low > 0.0)) {
        high = low, lag_high = lag_low;
        low -= MECHC_MEASURE_STRIDE;
        if (low < -MECHC_MEASURE_FAR) return hint;
        lag_low = mechc_measure_lag(one, p, hint * exp2(low));
    }
    for (int i = 0; i < 4 && !(lag_high > 0.0); i++) { /* regula falsi, kept off the ends */
        const double share = fmin(1.0 - MECHC_MEASURE_END, fmax(MECHC_MEASURE_END, lag_low / (lag_low - lag_high)));
        const double middle = low + share * (high - low);
        const double lag = mechc_measure_lag(one, p, hint * exp2(middle));
        if (lag > 0.0) low = middle, lag_low = lag;
        else high = middle, lag_high = lag;
    }
    return MECHC_MEASURE_LINKS * hint * exp2(high);
}

/* The greatest change of a row by steps of all coordinates together; its value if no step changes it. */
static double mechc_measure_row(const mechc_measure *one, int row)
{
    const mechc_closure *closure = one->closure;
    double most = 0.0, value = 0.0;
    for (int k = 0; k < MECHC_MEASURED; k++) {
        const double *gradient = one->gradient + k * closure->breadth[MECHC_GRADIENT]
                               + row * closure->columns;
        double sum = 0.0;
        for (int j = 0; j < closure->columns; j++) { /* one that may be held may be large */
            const double held = fabs(one->y[k * closure->width + j]);
            const int slides = closure->kind[j] == MECHC_TRANSLATION;
            sum += fabs(gradient[j]) * (slides ? fmax(one->length, held) : 1.0);
        }
        most = fmax(most, sum);
        value = fmax(value, fabs(one->gap[k * closure->breadth[MECHC_GAPS] + row]));
    }
    if (!(most > 0.0)) most = value;
    return most > 0.0 && most < HUGE_VAL ? most : 1.0;
}

/* Give rows with the same unit the size of the largest of them. */
static void mechc_measure_alike(mechc_measure *one, double *sizes)
{
    const int rows = one->closure->rows, *alike = one->closure->alike;
    for (int row = 0; row < rows; row++)
        sizes[alike[row]] = fmax(sizes[alike[row]], sizes[row]);
    for (int row = 0; row < rows; row++) sizes[row] = sizes[alike[row]];
}

/* Measure one member, whose held coordinates are those of q. `hint`: start of the search for the
 * length. */
static void mechc_measure_member(mechc_measure *one, const double *q, const double *p, double hint)
{
    const mechc_closure *closure = one->closure;
    double *sizes = one->weight;
    int translations = 0;
    for (int k = 0; k < MECHC_MEASURED; k++)
        memcpy(one->y + k * closure->width, q, (size_t)closure->coordinates * sizeof(double));
    for (int i = 0; i < one->unknowns; i++)
        translations |= closure->kind[one->unknown[i]] == MECHC_TRANSLATION;
    one->length = translations ? mechc_measure_length(one, p, hint) : hint;
    mechc_measure_at(one, p, one->length);
    for (int row = 0; row < closure->rows; row++) sizes[row] = mechc_measure_row(one, row);
    mechc_measure_alike(one, sizes);
    one->size = 0.0;
    one->even = 1;
    for (int row = 0; row < closure->rows; row++) one->size = fmax(one->size, sizes[row]);
    for (int row = 0; row < closure->rows; row++) {
        one->weight[row] = one->size / sizes[row];
        one->even &= one->weight[row] == 1.0;
    }
}

/* Scale the rows of gaps and gradients at some states by their sizes. */
static void mechc_measure_weigh(const mechc_measure *one, int count, double *gaps,
                                double *gradients)
{
    const mechc_closure *closure = one->closure;
    const int rows = closure->rows, columns = closure->columns;
    if (one->even) return;
    for (int k = 0; k < count; k++) {
        double *gap = gaps + k * closure->breadth[MECHC_GAPS];
        double *gradient = gradients + k * closure->breadth[MECHC_GRADIENT];
        for (int row = 0; row < rows; row++) {
            gap[row] *= one->weight[row];
            for (int j = 0; j < columns; j++) gradient[row * columns + j] *= one->weight[row];
        }
    }
}
