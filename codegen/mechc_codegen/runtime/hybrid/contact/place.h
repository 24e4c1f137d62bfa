/* The equations of motion at one state, with the effects of its contacts.
 *
 * M u' + J^T lambda = F + W^T f for forces f along the rows W of contacts.  With M = L L^T and what
 * lies along J L^-T taken out of the rows W L^-T =: R, the forces change u' by L^-T R^T f, and the
 * accelerations of gaps and slips by R R^T f.
 */
#pragma once

#include "hybrid/contact/room.h"
#include "hybrid/events/functions.h"
#include "hybrid/motion.h"
#include "closing/least_change.h"
#include "closing/triangular.h"

#define MECHC_CONTACT_DEPENDENT 1e-12 /* of the largest singular value: a smaller one is zero */
#define MECHC_CONTACT_APART 1e-3 /* of a state's size: neighbours of a difference along the motion */

/* Besides the status of a projection; the last: of a coefficient of friction that is negative, of a
 * restitution that is not 0 to 1. */
enum { MECHC_NO_MASS = -1, MECHC_NO_LAW = -2, MECHC_PUSHES = -3, MECHC_NO_RESTITUTION = -4 };

/* The contacts of a motion as the caller defines them. */
typedef struct {
    int count;
    const unsigned char *has_gap, *has_friction;
    const unsigned char *is_linear; /* slips and friction that parameters alone make linear functions of
                                       speeds and constants; NULL: not known */
    const int *event;  /* the event that each is */
    int poisson;       /* impacts by Poisson's law of restitution, not Newton's */
    mechc_contact_table table;
    void *context;
} mechc_contact_laws;

/* The current state, with q' (nq) behind it, and the table; where has_rows is set also L, rows R of gaps and
 * slips (n, nu each), N of q' = N u + b (nq, nu) and J; where has_accelerations is set also rates
 * (nq + nu) and accelerations of gaps and slips (n each) without forces of contacts. */
typedef struct {
    const mechc_motion *motion;
    const mechc_contact_laws *laws;
    int contacts, coordinates, speeds, rows, columns; /* columns: of the table */
    int identity;                                     /* whether q' = u */
    int has_rows, has_accelerations;
    int failed;                                       /* a contact without quantities */
    double t, *y, *v, *table, *root, *normal, *tangent, *kinematic, *loops, *free, *opening, *slipping;
    double *space; /* work space */
} mechc_contact_place;

MECHC_STATIC int mechc_contact_make(mechc_contact_place *c, const mechc_motion *motion, const mechc_contact_laws *laws)
{
    const size_t n = (size_t)laws->count, nq = (size_t)motion->coordinates;
    const size_t nu = (size_t)motion->speeds, nc = (size_t)motion->rows, width = nq + nu;
    c->motion = motion;
    c->laws = laws;
    c->contacts = laws->count;
    c->coordinates = motion->coordinates;
    c->speeds = motion->speeds;
    c->rows = motion->rows;
    c->columns = MECHC_LAWS + motion->width;
    c->identity = motion->unit->identity_kinematics;
    const mechc_part_of_room parts[] = {
        {&c->y, width + nq}, {&c->table, n * (size_t)c->columns}, {&c->root, nu * nu},
        {&c->normal, n * nu}, {&c->tangent, n * nu}, {&c->kinematic, nq * nu}, {&c->loops, nc * nu},
        {&c->free, width}, {&c->opening, n}, {&c->slipping, n},
        {&c->space, 3 * width + nc * (nu + 1) + 4 * n * nu + 4 * n + nu},
    };
    const int made = MECHC_ROOM_FOR(parts);
    c->v = c->y + width;
    return made;
}

MECHC_STATIC void mechc_contact_free(mechc_contact_place *c) { free(c->y); }

MECHC_STATIC const double *mechc_law(const mechc_contact_place *c, int contact)
{
    return c->table + contact * c->columns;
}

/* Evaluate the quantities of the contacts after time or speeds have changed; MECHC_NO_LAW if they are not
 * finite.  An open gap needs no slopes and no slip: in the middle of a bush there are none. */
MECHC_STATIC int mechc_contact_table_at_hand(mechc_contact_place *c)
{
    const int nq = c->coordinates;
    c->has_accelerations = 0;
    if (c->identity) memcpy(c->v, c->y + nq, (size_t)nq * sizeof(double));
    else {
        mechc_free_rates(c->motion, c->t, c->y, c->free);
        memcpy(c->v, c->free, (size_t)nq * sizeof(double));
    }
    c->failed = -1;
    if (!c->laws->table(c->laws->context, c->t, c->y, c->motion->p, c->table)) return MECHC_NO_LAW;
    for (int k = 0; k < c->contacts; k++) {
        double *row = c->table + k * c->columns;
        if (mechc_is_finite(row, c->columns)) continue;
        if (!(row[MECHC_GAP] > 0.0)) {
            c->failed = k;
            return MECHC_NO_LAW;
        }
        memset(row + 1, 0, (size_t)(c->columns - 1) * sizeof(double));
    }
    return MECHC_RUNNING;
}

/* The rate of a gap over one speed. */
MECHC_STATIC double mechc_gap_over_speed(const mechc_contact_place *c, int contact, int speed)
{
    const double *slopes = mechc_law(c, contact) + MECHC_LAWS;
    double rate = c->identity ? slopes[speed] : 0.0;
    for (int i = 0; !c->identity && i < c->coordinates; i++)
        rate += slopes[i] * c->kinematic[i * c->speeds + speed];
    return rate;
}

/* Compute N of q' = N u + b. */
MECHC_STATIC void mechc_contact_kinematics(mechc_contact_place *c)
{
    const int nq = c->coordinates, nu = c->speeds;
    double *moved = c->space, *other = moved + nq + nu;
    memcpy(moved, c->y, (size_t)(nq + nu) * sizeof(double));
    for (int j = 0; j < nu; j++) {
        moved[nq + j] += 1.0;
        mechc_free_rates(c->motion, c->t, moved, other);
        for (int i = 0; i < nq; i++) c->kinematic[i * nu + j] = other[i] - c->v[i];
        moved[nq + j] = c->y[nq + j];
    }
}

/* Remove from the rows (count, nu) their components along the rows of J L^-T. */
MECHC_STATIC void mechc_contact_without_loops(mechc_contact_place *c, double *rows, int count)
{
    const int nu = c->speeds, nc = c->rows;
    double *weighted = c->space, *lengths = weighted + nc * nu;
    memcpy(weighted, c->loops, (size_t)(nc * nu) * sizeof(double));
    for (int i = 0; i < nc; i++) mechc_solve_lower(c->root, nu, weighted + i * nu);
    mechc_orthogonal_rows(weighted, NULL, nc, nu, lengths);
    const double least = MECHC_CONTACT_DEPENDENT * mechc_largest(lengths, nc);
    for (int i = 0; i < nc; i++) {
        const double *row = weighted + i * nu;
        if (!(lengths[i] > least)) continue;
        for (int k = 0; k < count; k++) {
            const double share = mechc_inner_product(rows + k * nu, row, nu) / (lengths[i] * lengths[i]);
            for (int j = 0; j < nu; j++) rows[k * nu + j] -= share * row[j];
        }
    }
}

/* Evaluate the quantities of the contacts at a new state. */
MECHC_STATIC int mechc_contact_at_hand(mechc_contact_place *c)
{
    c->has_rows = 0;
    return mechc_contact_table_at_hand(c);
}

/* Compute the rows at the current state. */
MECHC_STATIC int mechc_contact_rows(mechc_contact_place *c)
{
    const int n = c->contacts, nq = c->coordinates, nu = c->speeds;
    if (c->has_rows) return MECHC_RUNNING;
    c->motion->unit->mass(c->t, c->y, c->motion->given, c->root);
    if (!mechc_cholesky(c->root, nu)) return MECHC_NO_MASS;
    if (!c->identity) mechc_contact_kinematics(c);
    for (int k = 0; k < n; k++) {
        const double *slopes = mechc_law(c, k) + MECHC_LAWS;
        double *normal = c->normal + k * nu, *tangent = c->tangent + k * nu;
        for (int j = 0; j < nu && c->laws->has_gap[k]; j++) /* else it stays zero */
            normal[j] = mechc_gap_over_speed(c, k, j);
        for (int j = 0; j < nu && c->laws->has_friction[k]; j++) tangent[j] = slopes[nq + j];
        if (c->laws->has_gap[k]) mechc_solve_lower(c->root, nu, normal);
        if (c->laws->has_friction[k]) mechc_solve_lower(c->root, nu, tangent);
    }
    if (c->rows) {
        mechc_motion_evaluate(c->motion, c->motion->jacobian, c->t, c->y, c->loops);
        mechc_contact_without_loops(c, c->normal, n);
        mechc_contact_without_loops(c, c->tangent, n);
    }
    c->has_rows = 1;
    return MECHC_RUNNING;
}

/* q'' along the motion, by central differences of eighth order (Fornberg 1988). */
MECHC_STATIC void mechc_contact_second_rates(mechc_contact_place *c, double *later)
{
    static const double weights[] = {1.0 / 280, -4.0 / 105, 1.0 / 5, -4.0 / 5};
    const int nq = c->coordinates, width = nq + c->speeds;
    double *moved = c->space, *other = moved + width, fastest = 1.0;
    for (int i = 0; i < width; i++)
        fastest = fmax(fastest, fabs(c->free[i]) / fmax(fabs(c->y[i]), c->motion->scale[i]));
    const double step = MECHC_CONTACT_APART / fastest;
    for (int i = 0; i < nq; i++) later[i] = 0.0;
    for (int place = -4; place <= 4; place++) {
        if (!place) continue;
        const double weight = place < 0 ? weights[place + 4] : -weights[4 - place];
        for (int i = 0; i < width; i++) moved[i] = c->y[i] + step * place * c->free[i];
        mechc_free_rates(c->motion, c->t + step * place, moved, other);
        for (int i = 0; i < nq; i++) later[i] += weight * other[i] / step;
    }
}

/* Compute rows, rates and accelerations without forces of contacts, at the current state. */
MECHC_STATIC int mechc_contact_accelerate(mechc_contact_place *c)
{
    const int nq = c->coordinates, nu = c->speeds, status = mechc_contact_rows(c);
    double *later = c->space + 2 * (nq + nu);
    if (status != MECHC_RUNNING || c->has_accelerations) return status;
    if (c->identity) mechc_free_rates(c->motion, c->t, c->y, c->free); /* else they are known */
    if (c->identity) later = c->free + nq;
    else mechc_contact_second_rates(c, later);
    for (int k = 0; k < c->contacts; k++) {
        const double *row = mechc_law(c, k);
        c->opening[k] = row[MECHC_BEND] + mechc_inner_product(row + MECHC_LAWS, later, nq);
        c->slipping[k] = row[MECHC_DRIFT] + mechc_inner_product(row + MECHC_LAWS + nq, c->free + nq, nu);
    }
    c->has_accelerations = 1;
    return MECHC_RUNNING;
}

/* Go to a state. */
MECHC_STATIC int mechc_contact_at(mechc_contact_place *c, double t, const double *y)
{
    c->t = t;
    memcpy(c->y, y, (size_t)(c->coordinates + c->speeds) * sizeof *y);
    return mechc_contact_at_hand(c);
}

/* Go to a state, and compute everything that forces of contacts depend on. */
MECHC_STATIC int mechc_contact_motion_at(mechc_contact_place *c, double t, const double *y)
{
    const int status = mechc_contact_at(c, t, y);
    return status == MECHC_RUNNING ? mechc_contact_accelerate(c) : status;
}

/* The rounding error of a gap's value, from the size of its terms. */
MECHC_STATIC double mechc_gap_rounding(const mechc_contact_place *c, int contact)
{
    const double *row = mechc_law(c, contact), *slopes = row + MECHC_LAWS;
    double terms = 0.0;
    for (int i = 0; i < c->coordinates; i++) terms += fabs(slopes[i] * c->y[i]);
    return DBL_EPSILON * (fabs((row[MECHC_RATE] - mechc_inner_product(slopes, c->v, c->coordinates)) * c->t) + terms);
}

/* Change the speeds y by a change along rows R. */
MECHC_STATIC void mechc_contact_change_speeds(const mechc_contact_place *c, double *change, double *y)
{
    mechc_solve_upper(c->root, c->speeds, change);
    for (int j = 0; j < c->speeds; j++) y[c->coordinates + j] += change[j];
}
