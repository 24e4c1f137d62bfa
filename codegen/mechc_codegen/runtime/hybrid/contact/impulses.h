/* Impacts of several contacts at once, by Newton's law of restitution or by Poisson's.
 *
 * By Newton's the contacts that touch get impulses p >= 0 that change the rates w of their gaps to w+ = w + A p,
 * A = W M^-1 W^T, with w+ + e w >= 0 and p (w+ + e w) = 0 (Moreau 1988; Glocker & Pfeiffer 1995,
 * Nonlinear Dynamics 7): a linear complementarity problem.  M is that of the speeds which the
 * constraints leave free.  With one e for all, energy changes by -(1 - e) / (1 + e) p^T A p / 2.
 *
 * By Poisson's law (Glocker & Pfeiffer 1995) compression has the impulses c of e = 0, and expansion
 * at least e c: e c + x, x >= 0, where a gap would still close, x w+ = 0.  With one e for all, energy
 * changes by -(1 - e^2) c^T A c / 2 at most.
 */
#pragma once

#include "abi/macros.h"
#include <math.h>
#include <string.h>
#include "closing/least_change.h"

#define MECHC_IMPACT_DEPENDENT 1e-13 /* of the largest singular value: a smaller one is zero */
#define MECHC_IMPACT_GAIN 1e-13 /* of the work of the impulses: energy that is rounding */
#define MECHC_IMPACT_SETTLED 1e-12 /* of the largest rate: one so small is 0 */
#define MECHC_IMPACT_EXACT 1e-9    /* the same, of what is accepted as a solution */
#define MECHC_IMPACT_SETS 30       /* sets of pressing contacts that are tried, a contact */

/* The component (A p + b)_i. */
MECHC_STATIC double mechc_rate_after(const double *a, const double *b, int n, const double *p, int i)
{
    double rate = b[i];
    for (int k = 0; k < n; k++) rate += a[i * n + k] * p[k];
    return rate;
}

/* Whether A p + b >= 0, and 0 where p > 0. */
MECHC_STATIC int mechc_is_complementary(const double *a, const double *b, int n, const double *p)
{
    const double size = MECHC_IMPACT_EXACT * mechc_largest(b, n);
    for (int i = 0; i < n; i++) {
        const double rate = mechc_rate_after(a, b, n, p, i);
        if (!(rate >= -size) || (p[i] > 0.0 && !(rate <= size))) return 0;
    }
    return 1;
}

/* The impulses with which all pressing contacts have A p + b = 0. `space`: n (n + 3) numbers. */
MECHC_STATIC void mechc_press(const double *a, const double *b, int n, const int *pressing, double *p,
                        double *space)
{
    double *part = space, *aim = part + n * n, *lengths = aim + n, *found = lengths + n;
    int rows = 0, entries = 0;
    for (int i = 0; i < n; i++) {
        if (!pressing[i]) continue;
        for (int k = 0; k < n; k++)
            if (pressing[k]) part[entries++] = a[i * n + k];
        aim[rows++] = -b[i];
    }
    mechc_least_change(part, aim, rows, rows, MECHC_IMPACT_DEPENDENT, lengths, found);
    rows = 0;
    for (int i = 0; i < n; i++) p[i] = pressing[i] ? found[rows++] : 0.0;
}

/* Move the impulses p towards those aimed at until the first of them would pull; its contact stops
 * pressing.  0 if none would pull. */
MECHC_STATIC int mechc_press_less(int n, int *pressing, const double *aim, double *p)
{
    double share = 1.0;
    int first = -1;
    for (int i = 0; i < n; i++) {
        if (!pressing[i] || aim[i] > 0.0) continue;
        const double part = p[i] > aim[i] ? p[i] / (p[i] - aim[i]) : 0.0;
        if (first < 0 || part < share) share = part, first = i;
    }
    for (int i = 0; i < n; i++) p[i] += share * (aim[i] - p[i]);
    if (first >= 0) pressing[first] = 0, p[first] = 0.0;
    return first >= 0;
}

/* The contact that closes fastest among those that do not press and were not tried; -1: none. */
MECHC_STATIC int mechc_closes(const double *a, const double *b, int n, const int *pressing,
                        const int *vain, const double *p)
{
    double least = -MECHC_IMPACT_SETTLED * mechc_largest(b, n);
    int closes = -1;
    for (int i = 0; i < n; i++) {
        if (pressing[i] || vain[i]) continue;
        const double rate = mechc_rate_after(a, b, n, p, i);
        if (rate < least) least = rate, closes = i;
    }
    return closes;
}

/* Solve p >= 0, A p + b >= 0, p^T (A p + b) = 0 for a symmetric A (n, n) without negative
 * eigenvalues, by sets of pressing contacts (Lawson & Hanson 1974, chapter 23).  0 if there is no
 * solution. `space`: n (n + 4); `sets`: 2 n. */
MECHC_STATIC int mechc_complementary(const double *a, const double *b, int n, double *p, double *space,
                               int *sets)
{
    int *pressing = sets, *vain = sets + n;
    double *aim = space + n * (n + 3);
    for (int i = 0; i < n; i++) p[i] = 0.0, pressing[i] = vain[i] = 0;
    for (int tried = 0; tried < MECHC_IMPACT_SETS * n; tried++) {
        const int next = mechc_closes(a, b, n, pressing, vain, p);
        if (next < 0) break;
        pressing[next] = 1;
        do mechc_press(a, b, n, pressing, aim, space);
        while (mechc_press_less(n, pressing, aim, p));
        for (int i = 0; i < n; i++) vain[i] = pressing[next] ? 0 : vain[i] || i == next;
    }
    return mechc_is_complementary(a, b, n, p);
}

/* The energy that the impulses add, p^T (w + w+) / 2. */
MECHC_STATIC double mechc_impact_energy(const double *a, const double *w, int n, const double *p)
{
    double energy = 0.0;
    for (int i = 0; i < n; i++) {
        double rate = w[i];
        for (int k = 0; k < n; k++) rate += 0.5 * a[i * n + k] * p[k];
        energy += p[i] * rate;
    }
    return energy;
}

/* Impulses by Newton's law.  0 if there are none. `space`: n (n + 5); `sets`: 2 n. */
MECHC_STATIC int mechc_by_newton(const double *a, const double *w, const double *e, int n, double *p,
                           double *space, int *sets)
{
    double *b = space;
    for (int i = 0; i < n; i++) b[i] = (1.0 + e[i]) * w[i];
    return mechc_complementary(a, b, n, p, b + n, sets);
}

/* Impulses by Poisson's law.  0 if there are none. `space`: n (n + 6); `sets`: 2 n. */
MECHC_STATIC int mechc_by_poisson(const double *a, const double *w, const double *e, int n, double *p,
                            double *space, int *sets)
{
    double *b = space, *restored = b + n;
    const double settled = MECHC_IMPACT_SETTLED * mechc_largest(w, n);
    if (!mechc_complementary(a, w, n, p, restored + n, sets)) return 0;
    for (int i = 0; i < n; i++) restored[i] = (1.0 + e[i]) * p[i];
    for (int i = 0; i < n; i++) {
        b[i] = mechc_rate_after(a, w, n, restored, i);
        if (fabs(b[i]) <= settled) b[i] = 0.0;
    }
    const int found = mechc_complementary(a, b, n, p, restored + n, sets);
    for (int i = 0; i < n; i++) p[i] += restored[i];
    return found;
}

/* Impulses p (n,) of n contacts with A, rates w before and restitution e; if different ones would
 * add energy, the least counts for all.  0 if there are none. `space`: n (n + 7); `sets`: 2 n. */
MECHC_STATIC int mechc_impulses(const double *a, const double *w, const double *e, int n, int poisson,
                          double *p, double *space, int *sets)
{
    int (*law)(const double *, const double *, const double *, int, double *, double *, int *) =
        poisson ? mechc_by_poisson : mechc_by_newton;
    double *same = space, least = INFINITY, size = 0.0;
    for (int i = 0; i < n; i++) least = fmin(least, e[i]);
    for (int i = 0; i < n; i++) same[i] = least;
    const int found = law(a, w, e, n, p, same + n, sets);
    for (int i = 0; i < n; i++) size += fabs(p[i] * w[i]);
    if (found && !(mechc_impact_energy(a, w, n, p) > MECHC_IMPACT_GAIN * size)) return 1;
    return law(a, w, same, n, p, same + n, sets);
}
