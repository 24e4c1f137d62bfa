/* Critical configurations: where the configuration rows lose rank beyond what they lose everywhere.
 *
 * Newton's method finds the nearby configuration q*, with J(q*)^T w = 0, |w| = 1 and every gap
 * closed but the one along w.  That gap, g = w . gap(q*), measures how far the lengths are from
 * those of a change point.  Only g distinguishes a change point (the curve of configurations
 * crosses itself) from a near miss (two curves pass each other); the least singular value does not.
 */
#pragma once

#include "singularities/gap.h"

#define MECHC_WHOLE_TURN 6.283185307179586 /* rad */
/* Pivots, of the first: of Newton's equations below which they leave a direction free, and of a form of
 * second differences below which it is flat. */
#define MECHC_LEFT_FREE 1e-9
#define MECHC_NO_CURVATURE 1e-5
/* Newton's steps, of the reach: the last one, and one that no longer halves, which is rounding. */
#define MECHC_NEWTON_ENDS 1e-10
#define MECHC_NEWTON_STALLS 1e-6
/* What a critical configuration known before, turned by whole turns, may miss of the largest partial
 * derivative: in its gaps and in J^T w. */
#define MECHC_STILL_CLOSED 1e-12
#define MECHC_STILL_SINGULAR 1e-9
/* What one that Newton's method finds may miss in J^T w and w . w. */
#define MECHC_FOUND_SINGULAR 1e-6

#if MECHC_NH_MAX > 0
/* Solve the square system a x = b in place, full pivoting; directions that the equations leave
 * free, whose pivots are below a share of the first, do not move.  The rank. */
MECHC_STATIC int mechc_solve(double *a, double *b, int n, double negligible)
{
    int order[MECHC_NU_MAX + MECHC_NH_MAX + 1];
    double x[MECHC_NU_MAX + MECHC_NH_MAX + 1], first = 0.0;
    int rank = 0;
    for (int i = 0; i < n; i++) order[i] = i;
    for (; rank < n; rank++) {
        int row = rank, column = rank;
        for (int i = rank; i < n; i++)
            for (int j = rank; j < n; j++)
                if (fabs(a[i * n + j]) > fabs(a[row * n + column])) row = i, column = j;
        const double pivot = a[row * n + column];
        if (rank == 0) first = fabs(pivot);
        if (!(fabs(pivot) > negligible * first)) break;
        for (int j = 0; j < n; j++) mechc_exchange(&a[rank * n + j], &a[row * n + j]);
        mechc_exchange(&b[rank], &b[row]);
        for (int i = 0; i < n; i++) mechc_exchange(&a[i * n + rank], &a[i * n + column]);
        const int kept = order[rank];
        order[rank] = order[column];
        order[column] = kept;
        for (int i = rank + 1; i < n; i++) {
            const double factor = a[i * n + rank] / a[rank * n + rank];
            for (int j = rank; j < n; j++) a[i * n + j] -= factor * a[rank * n + j];
            b[i] -= factor * b[rank];
        }
    }
    for (int i = rank; i < n; i++) x[i] = 0.0;
    for (int i = rank - 1; i >= 0; i--) {
        x[i] = b[i] - mechc_dot(a + i * n + i + 1, x + i + 1, rank - i - 1);
        x[i] /= a[i * n + i];
    }
    for (int i = 0; i < n; i++) b[order[i]] = x[i];
    return rank;
}

/* An entry of J, over the unit of its speed. */
MECHC_INLINE double mechc_partial(const mechc_scalar_place *place, int row, int j)
{
    return place->jacobian[row * MECHC_NU + j] * mechc_scalar_unit_of(place, MECHC_NQ + j);
}

/* The largest of these entries. */
MECHC_STATIC double mechc_largest_partial(const mechc_scalar_place *place)
{
    double largest = place->ordinary_sum;
    for (int i = 0; i < MECHC_NH; i++)
        for (int j = 0; j < MECHC_NU; j++)
            largest = mechc_max(largest, fabs(mechc_partial(place, i, j)));
    return largest;
}

/* J^T w, over the units of the speeds. */
MECHC_STATIC void mechc_pull_of(const mechc_scalar_place *place, const double *normal, double *out)
{
    for (int i = 0; i < MECHC_NU; i++) {
        out[i] = 0.0;
        for (int row = 0; row < MECHC_NH; row++)
            out[i] += mechc_partial(place, row, i) * normal[row];
    }
}

/* J^T w at q moved by `step` units along speed j; step 0: at q. */
MECHC_STATIC void mechc_pull(double t, const double *q, const mechc_scalar_given *given, int j,
                             double step, const double *normal, double *out)
{
    mechc_scalar_place place;
    double by[MECHC_NU_MAX] = {0}, moved[MECHC_NQ_MAX];
    by[j] = step * mechc_given_unit(given, MECHC_NQ + j);
    mechc_displace(t, q, given, by, moved);
    mechc_rows_at(t, moved, given, &place);
    mechc_pull_of(&place, normal, out);
}

/* The equations of a critical configuration, linearised: unknown are the move of q in the units of the
 * speeds, the change of w in the basis of the rows that count, and g in the unit of length returned. */
MECHC_STATIC double mechc_critical_equations(double t, const mechc_scalar_given *given,
                                             const mechc_scalar_place *place,
                                             const mechc_weakest *at, const mechc_critical *c,
                                             double *a, double *b)
{
    const int rank = at->rank, n = MECHC_NU + rank + 1;
    /* unit of g and of the rows: whatever the scene's unit of length is */
    const double length = mechc_largest_partial(place);
    double pull[MECHC_NU_MAX], moved[MECHC_NU_MAX], square = 0.0;
    memset(a, 0, (size_t)n * (size_t)n * sizeof *a);
    mechc_pull_of(place, c->normal, pull);
    for (int r = 0; r < rank; r++) {
        const double *basis = at->basis + r * MECHC_NH;
        const double normal = mechc_dot(basis, c->normal, MECHC_NH);
        b[r] = c->gap * normal - mechc_dot(basis, place->gap, MECHC_NH);
        for (int j = 0; j < MECHC_NU; j++) {
            double entry = 0.0;
            for (int i = 0; i < MECHC_NH; i++)
                entry += basis[i] * mechc_partial(place, i, j);
            a[r * n + j] = entry;
            a[(rank + j) * n + MECHC_NU + r] = entry;
        }
        a[r * n + MECHC_NU + r] = -c->gap;
        a[r * n + n - 1] = -normal;
        a[(n - 1) * n + MECHC_NU + r] = normal;
        square += normal * normal;
    }
    for (int j = 0; j < MECHC_NU && !mechc_scalar_stopped(given); j++) {
        b[rank + j] = -pull[j];
        mechc_pull(t, c->q, given, j, MECHC_SMALL_MOVE, c->normal, moved);
        for (int i = 0; i < MECHC_NU; i++)
            a[(rank + i) * n + j] = (moved[i] - pull[i]) / MECHC_SMALL_MOVE;
    }
    b[n - 1] = 0.5 * (1.0 - square);
    for (int i = 0; i < (n - 1) * n; i++) a[i] *= (i + 1) % n ? 1.0 / length : 1.0;
    for (int i = 0; i < n - 1; i++) b[i] /= length;
    return length;
}

/* Unit vectors, in weighted speeds, that span the rows which do not vanish at q*; their number. */
MECHC_STATIC int mechc_span_rows(const mechc_scalar_place *place, const mechc_critical *c,
                                 double *rows)
{
    double largest = sqrt(place->ordinary_length);
    for (int i = 0; i < MECHC_NH; i++)
        for (int j = 0; j < MECHC_NU; j++)
            rows[i * MECHC_NU + j] = mechc_partial(place, i, j) / c->speeds[j];
    for (int found = 0; found < MECHC_NH; found++) {
        double *row = rows + found * MECHC_NU, norm = 0.0;
        for (int i = found; i < MECHC_NH; i++) {
            const double *other = rows + i * MECHC_NU;
            if (mechc_dot(other, other, MECHC_NU) <= norm) continue;
            norm = mechc_dot(other, other, MECHC_NU);
            for (int j = 0; j < MECHC_NU; j++) mechc_exchange(&row[j], &rows[i * MECHC_NU + j]);
        }
        norm = sqrt(norm);
        largest = mechc_max(largest, norm);
        if (!(norm > MECHC_GENERIC * largest)) return found;
        for (int j = 0; j < MECHC_NU; j++) row[j] /= norm;
        for (int i = found + 1; i < MECHC_NH; i++) {
            const double part = mechc_dot(rows + i * MECHC_NU, row, MECHC_NU);
            for (int j = 0; j < MECHC_NU; j++) rows[i * MECHC_NU + j] -= part * row[j];
        }
    }
    return MECHC_NH;
}

/* The gap along w to second order: its quadratic form in the moves that the other rows allow, in
 * weighted speeds. */
MECHC_STATIC void mechc_second_form(double t, const mechc_scalar_given *given,
                                    const mechc_critical *c, double *form)
{
    double rows[MECHC_NH_MAX * MECHC_NU_MAX], pull[MECHC_NU_MAX], moved[MECHC_NU_MAX];
    mechc_scalar_place place;
    mechc_scalar_locate_all(t, c->q, given, &place);
    const int count = mechc_span_rows(&place, c, rows);
    mechc_pull_of(&place, c->normal, pull);
    for (int i = 0; i < MECHC_NU; i++) {
        mechc_pull(t, c->q, given, i, MECHC_SMALL_MOVE, c->normal, moved);
        for (int j = 0; j < MECHC_NU; j++)
            form[i * MECHC_NU + j] =
                (moved[j] - pull[j]) / (MECHC_SMALL_MOVE * c->speeds[i] * c->speeds[j]);
    }
    for (int k = 0; k < count; k++) { /* projected from both sides */
        const double *row = rows + k * MECHC_NU;
        for (int i = 0; i < MECHC_NU; i++) {
            const double part = mechc_dot(form + i * MECHC_NU, row, MECHC_NU);
            for (int j = 0; j < MECHC_NU; j++) form[i * MECHC_NU + j] -= part * row[j];
        }
        for (int j = 0; j < MECHC_NU; j++) {
            double part = 0.0;
            for (int i = 0; i < MECHC_NU; i++) part += form[i * MECHC_NU + j] * row[i];
            for (int i = 0; i < MECHC_NU; i++) form[i * MECHC_NU + j] -= part * row[i];
        }
    }
}

/* With several degrees of freedom, a form of rank 2 means that two sheets cross there, and a motion
 * that passes changes the sign of w; of a higher rank the set is a cone with its apex there, which a
 * motion goes around. */
MECHC_STATIC int mechc_is_of_curves(double t, const mechc_scalar_given *given,
                                    const mechc_critical *c)
{
    double form[MECHC_NU_MAX * MECHC_NU_MAX], zero[MECHC_NU_MAX] = {0};
    mechc_second_form(t, given, c, form);
    return mechc_solve(form, zero, MECHC_NU, MECHC_NO_CURVATURE) <= 2;
}

/* Whether J^T w vanishes there, for a w of length 1: rows that do not change let Newton's method stop where
 * it does not. */
MECHC_STATIC int mechc_is_singular_at(double t, const mechc_scalar_given *given, const mechc_critical *c)
{
    double pull[MECHC_NU_MAX], most = 0.0;
    mechc_scalar_place place;
    mechc_scalar_locate_all(t, c->q, given, &place);
    mechc_pull_of(&place, c->normal, pull);
    for (int j = 0; j < MECHC_NU; j++) most = mechc_max(most, fabs(pull[j]));
    return most <= MECHC_FOUND_SINGULAR * mechc_largest_partial(&place)
        && fabs(mechc_dot(c->normal, c->normal, MECHC_NH) - 1.0) <= MECHC_FOUND_SINGULAR;
}

/* Newton's method from q for a critical configuration whose normal is near the one given, in the
 * basis `at` q; 1 where it converged within the reach given (in mass-weighted speeds). */
MECHC_ONCE int mechc_find_critical_of(double t, const double *q, const mechc_scalar_given *given,
                                      const mechc_weakest *at, const double *normal, double reach,
                                      mechc_critical *c)
{
    const int rank = at->rank;
    double a[(MECHC_NU_MAX + MECHC_NH_MAX + 1) * (MECHC_NU_MAX + MECHC_NH_MAX + 1)];
    double b[MECHC_NU_MAX + MECHC_NH_MAX + 1], travelled = 0.0, last = HUGE_VAL;
    mechc_scalar_place place;
    memcpy(c->q, q, MECHC_NQ * sizeof *q);
    for (int iteration = 0; iteration < 12; iteration++) {
        mechc_scalar_locate_all(t, c->q, given, &place);
        if (iteration == 0) {
            memcpy(c->normal, normal, MECHC_NH * sizeof *normal);
            c->gap = 0.0;
            mechc_scalar_moved_masses(place.mass, place.length, c->speeds);
            for (int j = 0; j < MECHC_NU; j++)
                c->speeds[j] = sqrt(c->speeds[j]) * mechc_given_unit(given, MECHC_NQ + j);
        }
        const double length = mechc_critical_equations(t, given, &place, at, c, a, b);
        if (mechc_scalar_stopped(given)) return 0;
        mechc_solve(a, b, MECHC_NU + rank + 1, MECHC_LEFT_FREE);
        double square = 0.0;
        for (int j = 0; j < MECHC_NU; j++) square += mechc_squared(b[j] * c->speeds[j]);
        const double moved_by = sqrt(square);
        travelled += moved_by;
        if (!(travelled <= reach)) return 0;
        double moved[MECHC_NQ_MAX];
        for (int j = 0; j < MECHC_NU; j++) b[j] *= mechc_given_unit(given, MECHC_NQ + j);
        mechc_displace(t, c->q, given, b, moved);
        memcpy(c->q, moved, MECHC_NQ * sizeof *moved);
        for (int r = 0; r < rank; r++)
            for (int i = 0; i < MECHC_NH; i++)
                c->normal[i] += b[MECHC_NU + r] * at->basis[r * MECHC_NH + i];
        c->gap += length * b[MECHC_NU + rank];
        const int by_rounding = moved_by <= MECHC_NEWTON_STALLS * reach && moved_by >= 0.5 * last;
        last = moved_by;
        if (by_rounding || moved_by <= MECHC_NEWTON_ENDS * reach) {
            if (!mechc_is_singular_at(t, given, c)) return 0;
            mechc_measure_gap(t, given, c);
            c->curves = MECHC_NU - rank < 2 || mechc_is_of_curves(t, given, c);
            return 1;
        }
    }
    return 0;
}

/* Newton's method for a critical configuration from the weakest direction. */
MECHC_STATIC int mechc_find_critical(double t, const double *q, const mechc_scalar_given *given,
                                     const mechc_weakest *at, double reach, mechc_critical *c)
{
    return mechc_find_critical_of(t, q, given, at, at->left, reach, c);
}

/* Weight of coordinate i in distances: the mass it moves where speeds are its rates. */
MECHC_STATIC double mechc_weight(const mechc_scalar_given *given, const mechc_critical *c, int i)
{
    const double unit = mechc_given_unit(given, i);
    if (MECHC_IDENTITY_KINEMATICS) return mechc_squared(c->speeds[i] / unit);
    double heaviest = 0.0;
    for (int j = 0; j < MECHC_NU; j++) heaviest = mechc_max(heaviest, c->speeds[j]);
    return i < MECHC_NQ - MECHC_STATES ? mechc_squared(heaviest / unit) : 0.0;
}

/* Whether the critical configuration found before, apart from whole turns of angles, is one here
 * too.  Then it is stored in c. */
MECHC_ONCE int mechc_still_critical(double t, const double *q, const mechc_scalar_given *given,
                                    double reach, const mechc_critical *known, mechc_critical *c)
{
    double square = 0.0, largest = 0.0;
    int turned = 0;
    mechc_scalar_place place;
    *c = *known;
    for (int i = 0; i < MECHC_NQ - MECHC_STATES; i++) {
        const double turns = nearbyint((q[i] - known->q[i]) / MECHC_WHOLE_TURN);
        if (turns != 0.0) c->q[i] += turns * MECHC_WHOLE_TURN, turned = 1;
        square += mechc_weight(given, c, i) * mechc_squared(q[i] - c->q[i]);
    }
    if (!(square <= reach * reach)) return 0;
    mechc_scalar_locate_all(t, c->q, given, &place);
    largest = mechc_largest_partial(&place);
    for (int i = 0; i < MECHC_NH; i++)
        if (!(fabs(place.gap[i] - c->gap * c->normal[i]) <= MECHC_STILL_CLOSED * largest + c->rounding))
            return 0;
    for (int j = 0; j < MECHC_NU; j++) {
        double pull = 0.0;
        for (int i = 0; i < MECHC_NH; i++)
            pull += mechc_partial(&place, i, j) * c->normal[i];
        if (!(fabs(pull) <= MECHC_STILL_SINGULAR * largest)) return 0;
    }
    if (turned) mechc_measure_gap(t, given, c);
    return 1;
}

#endif
