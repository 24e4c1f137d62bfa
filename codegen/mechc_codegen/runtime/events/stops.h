/* Stops: events whose value is a gap that closes, and the impact that keeps it from growing less. */
#pragma once

#include "events/free_rows.h"
#include "events/impact.h"
#include "events/impulse.h"

#define MECHC_RESET_TOUCHING 10.0 /* times rtol of an event's largest value: it may be zero */

/* What an event may be where it is zero as far as the motion is known. */
static double mechc_event_nothing(const mechc_watch *watch, int number)
{
    return MECHC_RESET_TOUCHING * watch->rtol * watch->event[number].size;
}

/* The stops that touch, the one that closes among them; how many. */
static int mechc_touching(mechc_watch *watch, int number, double t, const double *y)
{
    int count = 0;
    for (int k = 0; k < watch->count; k++) {
        if (!watch->functions[k].restitution) continue;
        const double gap = fabs(mechc_event_value(watch, k, t, y));
        if (k == number || gap <= mechc_event_nothing(watch, k)) watch->touching[count++] = k;
    }
    return count;
}

/* How the rates of the gaps change with the speeds, rows W (count, speeds): the coordinates' rates
 * are linear in them. */
static void mechc_gap_rows(mechc_watch *watch, int count, double t, const double *y, double *rows)
{
    const int n = watch->speeds, first = watch->coordinates;
    mechc_given *given = (mechc_given *)watch->prepared;
    double *moved = watch->rates + 3 * watch->width, *other = watch->rates + watch->width;
    watch->unit->give(watch->p, watch->inputs, given);
    watch->unit->rates(t, y, given, watch->rates);
    memcpy(moved, y, (size_t)watch->width * sizeof(double));
    for (int j = 0; j < n; j++) {
        const double step = fmax(fabs(y[first + j]), 1.0);
        moved[first + j] = y[first + j] + step;
        watch->unit->rates(t, moved, given, other);
        for (int i = 0; i < first; i++)
            other[i] = (other[i] - watch->rates[i]) / (moved[first + j] - y[first + j]);
        moved[first + j] = y[first + j];
        for (int k = 0; k < count; k++) {
            const int event = watch->touching[k];
            double *slopes = watch->slopes, row = 0.0;
            watch->functions[event].slopes(t, y, watch->p, slopes);
            for (int i = 0; i < first; i++) row += slopes[1 + i] * other[i];
            rows[k * n + j] = row;
        }
    }
}

/* Count the other stops that an impact acts on with the impulses p, at the state y before it.  0
 * without memory. */
static int mechc_note_impacts(mechc_watch *watch, int number, int count, const double *p, double t,
                              const double *y)
{
    for (int i = 0; i < count; i++) {
        mechc_event *event = watch->event + watch->touching[i];
        if (watch->touching[i] == number || !(p[i] > 0.0)) continue;
        if (!mechc_reset_note(watch, watch->touching[i], y)) return 0;
        event->count++;
        event->latest = event->last = t;
        event->done = 1;
    }
    return 1;
}

/* The speeds after the impact at a stop that closes, of all stops that touch; 0 where there are
 * none. */
static int mechc_stop_impact(mechc_watch *watch, int number, double t, double *y)
{
    const int n = watch->speeds, first = watch->coordinates, nc = watch->rows;
    const int count = mechc_touching(watch, number, t, y);
    double *mass = watch->impulse, *weighted = mass + n * n, *lengths = weighted + 2 * nc * n;
    double *rows = watch->contacts, *a = rows + count * n, *w = a + count * count;
    double *e = w + count, *p = e + count, *change = p + count, *space = change + n;
    mechc_gap_rows(watch, count, t, y, rows);
    mechc_watch_evaluate(watch, watch->mass, t, y, mass);
    if (!mechc_cholesky(mass, n)) return 0;
    for (int k = 0; k < count; k++) mechc_solve_lower(mass, n, rows + k * n);
    if (nc) {
        mechc_watch_evaluate(watch, watch->jacobian, t, y, weighted);
        for (int i = 0; i < nc; i++) mechc_solve_lower(mass, n, weighted + i * n);
        mechc_orthogonal_rows(weighted, NULL, nc, n, lengths);
        mechc_take_out(rows, count, weighted, nc, lengths, n);
    }
    for (int i = 0; i < count; i++) {
        w[i] = watch->event[watch->touching[i]].rate;
        e[i] = watch->functions[watch->touching[i]].restitution(t, y, watch->p);
        for (int k = 0; k < count; k++) {
            a[i * count + k] = 0.0;
            for (int j = 0; j < n; j++) a[i * count + k] += rows[i * n + j] * rows[k * n + j];
        }
    }
    const int poisson = watch->functions[number].poisson;
    if (!mechc_impulses(a, w, e, count, poisson, p, space, watch->touching + watch->count)) return 0;
    if (!mechc_note_impacts(watch, number, count, p, t, y)) return 0;
    for (int j = 0; j < n; j++) {
        change[j] = 0.0;
        for (int k = 0; k < count; k++) change[j] += rows[k * n + j] * p[k];
    }
    mechc_solve_upper(mass, n, change);
    for (int j = 0; j < n; j++) y[first + j] += change[j];
    return 1;
}
