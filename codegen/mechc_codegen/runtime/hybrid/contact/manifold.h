/* Projection of states onto the constraints of a mode of contact. */
#pragma once

#include "hybrid/contact/problem.h"

#define MECHC_CONTACT_ITERATIONS 20

/* Whether a contact keeps its gap closed. */
MECHC_STATIC int mechc_keeps_gap(const mechc_contact_place *c, const unsigned char *mode, int contact)
{
    return c->laws->has_gap[contact] && mode[contact] != MECHC_OPEN;
}

/* Whether the mode keeps anything closed or without slip. */
MECHC_STATIC int mechc_mode_holds(const mechc_contact_place *c, const unsigned char *mode)
{
    int holds = 0;
    for (int k = 0; k < c->contacts; k++) holds |= mechc_keeps_gap(c, mode, k) || mode[k] == MECHC_STICKS;
    return holds;
}

/* Whether the gaps that the mode keeps are closed, to rounding. */
MECHC_STATIC int mechc_contact_is_closed(const mechc_contact_place *c, const unsigned char *mode)
{
    int settled = 1;
    for (int k = 0; k < c->contacts; k++) {
        const double *row = mechc_law(c, k);
        double terms = 0.0;
        if (!mechc_keeps_gap(c, mode, k)) continue;
        for (int i = 0; i < c->coordinates; i++)
            terms += fabs(row[MECHC_LAWS + i]) * fmax(fabs(c->y[i]), 1.0);
        settled &= fabs(row[MECHC_GAP]) <= 4.0 * DBL_EPSILON * fmax(terms, 1.0);
    }
    return settled;
}

/* Add the least change of speeds (nu) for which R x = values. */
MECHC_STATIC void mechc_contact_step(mechc_contact_place *c, double *rows, double *values, int count,
                               double *step)
{
    mechc_least_change(rows, values, count, c->speeds, MECHC_CONTACT_DEPENDENT, values + count, step);
    mechc_solve_upper(c->root, c->speeds, step);
}

/* Move to the nearest coordinates, in the metric of M, at which the mode's gaps are closed. */
MECHC_STATIC int mechc_contact_onto_gaps(mechc_contact_place *c, const unsigned char *mode)
{
    const mechc_motion *motion = c->motion;
    const int nq = c->coordinates, nu = c->speeds, most = 2 * c->contacts;
    double *rows = c->space + 3 * (nq + nu) + c->rows * (nu + 1), *missing = rows + most * nu;
    double *step = missing + 2 * most, moved[2];
    int status = MECHC_RUNNING;
    for (int tries = 0; tries < MECHC_CONTACT_ITERATIONS; tries++) {
        int count = 0;
        if (c->rows) status = motion->unit->project(c->t, c->y, motion->p, motion->inputs, moved);
        int found = mechc_contact_at_hand(c);
        if (found != MECHC_RUNNING) return found;
        if (status != MECHC_RUNNING || mechc_contact_is_closed(c, mode)) break;
        found = mechc_contact_rows(c);
        if (found != MECHC_RUNNING) return found;
        for (int k = 0; k < c->contacts; k++) {
            if (!mechc_keeps_gap(c, mode, k)) continue;
            memcpy(rows + count * nu, c->normal + k * nu, (size_t)nu * sizeof(double));
            missing[count++] = -mechc_law(c, k)[MECHC_GAP];
        }
        mechc_contact_step(c, rows, missing, count, step);
        for (int i = 0; i < nq; i++)
            c->y[i] += c->identity ? step[i] : mechc_inner_product(c->kinematic + i * nu, step, nu);
    }
    return status;
}

/* Change to the nearest speeds at which these gaps stay closed and sticking contacts do not slip. */
MECHC_STATIC int mechc_contact_with_speeds(mechc_contact_place *c, const unsigned char *mode)
{
    const int n = c->contacts, nq = c->coordinates, nu = c->speeds, most = 2 * n;
    double *rows = c->space + 3 * (nq + nu) + c->rows * (nu + 1), *off = rows + most * nu;
    double *step = off + 2 * most;
    int count = 0;
    if (!mechc_mode_holds(c, mode)) return MECHC_RUNNING;
    const int status = mechc_contact_rows(c);
    if (status != MECHC_RUNNING) return status;
    for (int slip = 0; slip < 2; slip++)
        for (int k = 0; k < n; k++) {
            if (!(slip ? mode[k] == MECHC_STICKS : mechc_keeps_gap(c, mode, k))) continue;
            memcpy(rows + count * nu, (slip ? c->tangent : c->normal) + k * nu,
                   (size_t)nu * sizeof(double));
            off[count++] = -mechc_law(c, k)[slip ? MECHC_SLIP : MECHC_RATE];
        }
    mechc_contact_step(c, rows, off, count, step);
    for (int j = 0; j < nu; j++) c->y[nq + j] += step[j];
    return mechc_contact_table_at_hand(c);
}

/* Move a state onto a mode's constraints, and go to it. */
MECHC_STATIC int mechc_contact_settle(mechc_contact_place *c, const unsigned char *mode, double t, double *y)
{
    const size_t size = (size_t)(c->coordinates + c->speeds) * sizeof *y;
    c->t = t;
    memcpy(c->y, y, size);
    int status = mechc_contact_onto_gaps(c, mode);
    if (status == MECHC_RUNNING) status = mechc_contact_with_speeds(c, mode);
    if (status == MECHC_RUNNING) memcpy(y, c->y, size);
    return status;
}
