/* The equations of motion at one state with what contacts there do, and states put onto contacts.
 *
 * M u' + J^T lambda = F + W^T f for forces f along the rows W of contacts.  With M = L L^T and what
 * lies along J L^-T taken out of the rows W L^-T =: R, the forces change u' by L^-T R^T f.  In a mode
 * some gaps are kept at zero, and some contacts do not slip: their forces are those with which the
 * accelerations there are zero; that of a sliding one follows from its normal force.
 */
#pragma once

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "abi/codes.h"
#include "abi/model.h"
#include "closing/least_change.h"
#include "closing/triangular.h"
#include "events/free_rows.h"

#define MECHC_CONTACT_DEPENDENT 1e-12 /* of the largest singular value: a smaller one is zero */
#define MECHC_CONTACT_ITERATIONS 20
#define MECHC_CONTACT_APART 1e-3 /* of a state's size: neighbours of a difference along the motion */

enum { MECHC_NO_MASS = -1, MECHC_NO_LAW = -2 }; /* besides the status of a projection */

/* The quantities of n contacts at (t, state = q, u, q'), a row of 8 + nq + nu each: gap, its rate, the
 * part of its acceleration that is not linear in q'', slip, the part of its rate without u',
 * restitution, friction, static friction, slopes of the gap by q, rows of the slip over u. */
typedef int mechc_contact_laws(void *context, double t, const double *state, const double *p,
                               double *table);
enum {
    MECHC_GAP, MECHC_RATE, MECHC_BEND, MECHC_SLIP, MECHC_DRIFT, MECHC_RESTITUTION, MECHC_FRICTION,
    MECHC_STATIC, MECHC_LAWS
};

/* A mode of contact, of each: whether its gap is kept, whether it sticks, and 1 or -1 where it
 * slides. */
typedef struct {
    const unsigned char *closed, *stuck;
    const double *way;
} mechc_contact_mode;

typedef struct {
    const mechc_unit *unit;
    const double *p, *scale;
    const mechc_inputs *inputs;
    const unsigned char *has_gap;
    mechc_contact_laws *laws;
    void *context;
    int contacts, coordinates, speeds, rows, columns; /* columns: of the table */
    int plain;                                        /* whether q' = u */
    int mass, jacobian;                               /* places of these outputs in the unit */
    int failed;                                       /* a contact without quantities */
    /* At the state at hand: q' (nq), the table, L, rows R of gaps and slips (2 n, nu), N of
     * q' = N u + b (nq, nu), J, rates without contacts (nq + nu), accelerations of gaps and slips
     * without forces (2 n), rates in the mode. */
    double t, *y, *v, *table, *root, *normal, *tangent, *kinematic, *loops, *free, *opening, *slipping;
    double *rates;
    void *prepared;
    double *space; /* all of the above, and work space from here on */
} mechc_contact;

/* Numbers of work space. */
static size_t mechc_contact_work(const mechc_contact *c)
{
    const size_t n = (size_t)c->contacts, nu = (size_t)c->speeds, nc = (size_t)c->rows;
    const size_t width = (size_t)c->coordinates + nu, most = 2 * n;
    const size_t work = 3 * width + nc * (nu + 1) + 2 * most * nu + most * most + 3 * most + 3 * nu;
    return work + n * (size_t)c->columns; /* compiled laws read so much, whatever it is */
}

/* Room for one scene; 0 without memory. */
static int mechc_contact_make(mechc_contact *c)
{
    const size_t n = (size_t)c->contacts, nq = (size_t)c->coordinates, nu = (size_t)c->speeds;
    const size_t width = nq + nu;
    const struct { double **at; size_t count; } parts[] = {
        {&c->y, width}, {&c->v, nq}, {&c->table, n * (size_t)c->columns}, {&c->root, nu * nu},
        {&c->normal, n * nu}, {&c->tangent, n * nu}, {&c->kinematic, nq * nu},
        {&c->loops, (size_t)c->rows * nu}, {&c->free, width}, {&c->opening, n}, {&c->slipping, n},
        {&c->rates, width}, {&c->space, mechc_contact_work(c)},
    };
    size_t all = 0;
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) all += parts[i].count;
    double *room = calloc(all + 1, sizeof *room);
    c->prepared = malloc(c->unit->given_size + sizeof(double));
    c->y = room;
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) *parts[i].at = room, room += parts[i].count;
    return c->y && c->prepared;
}

static void mechc_contact_free(mechc_contact *c)
{
    free(c->y);
    free(c->prepared);
}

static void mechc_contact_evaluate(const mechc_contact *c, int output, double *out)
{
    const mechc_rows times = {&c->t, 0}, states = {c->y, c->coordinates + c->speeds}, p = {c->p, 0};
    c->unit->outputs[output].evaluate(1, times, states, p, c->inputs, out);
}

static void mechc_contact_rates(const mechc_contact *c, double t, const double *y, double *out)
{
    c->unit->rates(t, y, (const mechc_given *)c->prepared, out);
}

/* Quantities of the contacts at the state at hand; MECHC_NO_LAW where they are not finite.  An open
 * gap needs no slopes and no slip: in the middle of a bush there are none. */
static int mechc_contact_table(mechc_contact *c)
{
    const int nq = c->coordinates, width = nq + c->speeds;
    double *state = c->space;
    if (c->plain) memcpy(c->v, c->y + nq, (size_t)nq * sizeof(double));
    else {
        mechc_contact_rates(c, c->t, c->y, c->free);
        memcpy(c->v, c->free, (size_t)nq * sizeof(double));
    }
    memcpy(state, c->y, (size_t)width * sizeof(double));
    memcpy(state + width, c->v, (size_t)nq * sizeof(double));
    c->failed = -1;
    if (!c->laws(c->context, c->t, state, c->p, c->table)) return MECHC_NO_LAW;
    for (int k = 0; k < c->contacts; k++) {
        double *row = c->table + k * c->columns;
        int finite = 1;
        for (int i = 0; i < c->columns; i++) finite &= isfinite(row[i]) != 0;
        if (finite) continue;
        if (!(row[MECHC_GAP] > 0.0)) {
            c->failed = k;
            return MECHC_NO_LAW;
        }
        memset(row + 1, 0, (size_t)(c->columns - 1) * sizeof(double));
    }
    return MECHC_RUNNING;
}

/* N of q' = N u + b. */
static void mechc_contact_kinematics(mechc_contact *c)
{
    const int nq = c->coordinates, nu = c->speeds;
    double *moved = c->space, *other = moved + nq + nu;
    memcpy(moved, c->y, (size_t)(nq + nu) * sizeof(double));
    for (int j = 0; j < nu; j++) {
        moved[nq + j] += 1.0;
        mechc_contact_rates(c, c->t, moved, other);
        for (int i = 0; i < nq; i++) c->kinematic[i * nu + j] = other[i] - c->v[i];
        moved[nq + j] = c->y[nq + j];
    }
}

/* What of the rows (count, nu) does not lie along the rows of J L^-T. */
static void mechc_contact_without_loops(mechc_contact *c, double *rows, int count)
{
    const int nu = c->speeds, nc = c->rows;
    double *weighted = c->space, *lengths = weighted + nc * nu;
    memcpy(weighted, c->loops, (size_t)(nc * nu) * sizeof(double));
    for (int i = 0; i < nc; i++) mechc_solve_lower(c->root, nu, weighted + i * nu);
    mechc_orthogonal_rows(weighted, NULL, nc, nu, lengths);
    const double least = MECHC_CONTACT_DEPENDENT * mechc_largest(lengths, nc);
    for (int i = 0; i < nc; i++)
        if (!(lengths[i] > least)) lengths[i] = 0.0;
    mechc_take_out(rows, count, weighted, nc, lengths, nu);
}

/* All that contacts need at the state at hand, but for accelerations. */
static int mechc_contact_place(mechc_contact *c)
{
    const int n = c->contacts, nq = c->coordinates, nu = c->speeds;
    const int status = mechc_contact_table(c);
    if (status != MECHC_RUNNING) return status;
    mechc_contact_evaluate(c, c->mass, c->root);
    if (!mechc_cholesky(c->root, nu)) return MECHC_NO_MASS;
    if (!c->plain) mechc_contact_kinematics(c);
    for (int k = 0; k < n; k++) {
        const double *slopes = c->table + k * c->columns + MECHC_LAWS;
        double *normal = c->normal + k * nu;
        for (int j = 0; j < nu; j++) {
            normal[j] = c->plain ? slopes[j] : 0.0;
            for (int i = 0; !c->plain && i < nq; i++) normal[j] += slopes[i] * c->kinematic[i * nu + j];
        }
        memcpy(c->tangent + k * nu, slopes + nq, (size_t)nu * sizeof(double));
        mechc_solve_lower(c->root, nu, normal);
        mechc_solve_lower(c->root, nu, c->tangent + k * nu);
    }
    if (c->rows) {
        mechc_contact_evaluate(c, c->jacobian, c->loops);
        mechc_contact_without_loops(c, c->normal, n);
        mechc_contact_without_loops(c, c->tangent, n);
    }
    return MECHC_RUNNING;
}

/* -- states put onto contacts ------------------------------------------------------------------ */

/* Whether the gaps that are to be closed are, as far as doubles tell; their rows and what is missing
 * are gathered. */
static int mechc_contact_is_closed(const mechc_contact *c, const unsigned char *closed, double *rows,
                                   double *missing, int *count)
{
    int settled = 1;
    *count = 0;
    for (int k = 0; k < c->contacts; k++) {
        const double *row = c->table + k * c->columns;
        double terms = 0.0;
        if (!closed[k]) continue;
        for (int i = 0; i < c->coordinates; i++)
            terms += fabs(row[MECHC_LAWS + i]) * fmax(fabs(c->y[i]), 1.0);
        settled &= fabs(row[MECHC_GAP]) <= 4.0 * DBL_EPSILON * fmax(terms, 1.0);
        memcpy(rows + *count * c->speeds, c->normal + k * c->speeds,
               (size_t)c->speeds * sizeof(double));
        missing[(*count)++] = -row[MECHC_GAP];
    }
    return settled;
}

/* Speeds (nu) that make the least change with rows R x = values. */
static void mechc_contact_step(mechc_contact *c, double *rows, double *values, int count, double *step)
{
    mechc_least_change(rows, values, count, c->speeds, MECHC_CONTACT_DEPENDENT, values + count, step);
    mechc_solve_upper(c->root, c->speeds, step);
}

/* Move to the nearest coordinates, in the metric of M, at which gaps are closed. */
static int mechc_contact_onto_gaps(mechc_contact *c, const unsigned char *closed)
{
    const int nq = c->coordinates, nu = c->speeds, most = 2 * c->contacts;
    double *rows = c->space + 3 * (nq + nu) + c->rows * (nu + 1), *missing = rows + most * nu;
    double *step = missing + 2 * most, moved[2];
    int status = MECHC_RUNNING, count;
    for (int tries = 0; tries < MECHC_CONTACT_ITERATIONS; tries++) {
        if (c->rows) status = c->unit->project(c->t, c->y, c->p, c->inputs, moved);
        const int found = mechc_contact_place(c);
        if (found != MECHC_RUNNING) return found;
        if (status != MECHC_RUNNING || mechc_contact_is_closed(c, closed, rows, missing, &count)) break;
        mechc_contact_step(c, rows, missing, count, step);
        for (int i = 0; i < nq; i++) {
            if (c->plain) c->y[i] += step[i];
            for (int j = 0; !c->plain && j < nu; j++) c->y[i] += c->kinematic[i * nu + j] * step[j];
        }
    }
    return status;
}

/* Change to the nearest speeds at which these gaps keep and these contacts do not slip. */
static int mechc_contact_with_speeds(mechc_contact *c, const unsigned char *closed,
                                     const unsigned char *stuck)
{
    const int n = c->contacts, nq = c->coordinates, nu = c->speeds, most = 2 * n;
    double *rows = c->space + 3 * (nq + nu) + c->rows * (nu + 1), *off = rows + most * nu;
    double *step = off + 2 * most;
    int count = 0;
    for (int kind = 0; kind < 2; kind++)
        for (int k = 0; k < n; k++) {
            if (!(kind ? stuck[k] : closed[k])) continue;
            memcpy(rows + count * nu, (kind ? c->tangent : c->normal) + k * nu,
                   (size_t)nu * sizeof(double));
            off[count++] = -c->table[k * c->columns + (kind ? MECHC_SLIP : MECHC_RATE)];
        }
    if (!count) return MECHC_RUNNING;
    mechc_contact_step(c, rows, off, count, step);
    for (int j = 0; j < nu; j++) c->y[nq + j] += step[j];
    return mechc_contact_table(c);
}

/* -- accelerations ----------------------------------------------------------------------------- */

/* q'' along the motion, by central differences of eighth order (Fornberg 1988). */
static void mechc_contact_second_rates(mechc_contact *c, double *later)
{
    static const double weights[] = {1 / 280.0, -4 / 105.0, 1 / 5.0, -4 / 5.0};
    const int nq = c->coordinates, width = nq + c->speeds;
    double *moved = c->space, *other = moved + width, fastest = 1.0;
    for (int i = 0; i < width; i++)
        fastest = fmax(fastest, fabs(c->free[i]) / fmax(fabs(c->y[i]), c->scale[i]));
    const double step = MECHC_CONTACT_APART / fastest;
    for (int i = 0; i < nq; i++) later[i] = 0.0;
    for (int place = -4; place <= 4; place++) {
        if (!place) continue;
        const double weight = place < 0 ? weights[place + 4] : -weights[4 - place];
        for (int i = 0; i < width; i++) moved[i] = c->y[i] + step * place * c->free[i];
        mechc_contact_rates(c, c->t + step * place, moved, other);
        for (int i = 0; i < nq; i++) later[i] += weight * other[i] / step;
    }
}

/* The accelerations without forces of contacts, at the place at hand. */
static void mechc_contact_set_free(mechc_contact *c)
{
    const int nq = c->coordinates, nu = c->speeds;
    double *later = c->space + 2 * (nq + nu);
    mechc_contact_rates(c, c->t, c->y, c->free);
    if (c->plain) later = c->free + nq;
    else mechc_contact_second_rates(c, later);
    for (int k = 0; k < c->contacts; k++) {
        const double *row = c->table + k * c->columns;
        c->opening[k] = row[MECHC_BEND];
        c->slipping[k] = row[MECHC_DRIFT];
        for (int i = 0; i < nq; i++) c->opening[k] += row[MECHC_LAWS + i] * later[i];
        for (int j = 0; j < nu; j++) c->slipping[k] += row[MECHC_LAWS + nq + j] * c->free[nq + j];
    }
}

/* One unknown force: its row, and the column along which it acts. */
static void mechc_contact_unknown(int nu, const double *row, const double *other, double slope,
                                  double *a, double *b)
{
    for (int j = 0; j < nu; j++) {
        a[j] = row[j];
        b[j] = row[j] - slope * other[j];
    }
}

/* The unknown forces of a mode: rows a and columns b, and what is to be made 0; how many.  `given`
 * (nu): what friction does where its force is known. */
static int mechc_contact_unknowns(const mechc_contact *c, const mechc_contact_mode *mode, double *a,
                                  double *b, double *aim, double *given)
{
    const int nu = c->speeds;
    int count = 0;
    memset(given, 0, (size_t)nu * sizeof(double));
    for (int k = 0; k < c->contacts; k++) {
        const double *normal = c->normal + k * nu, *tangent = c->tangent + k * nu;
        const double slope = mode->way[k] * c->table[k * c->columns + MECHC_FRICTION];
        if (mode->closed[k]) {
            mechc_contact_unknown(nu, normal, tangent, slope, a + count * nu, b + count * nu);
            aim[count++] = -c->opening[k];
        }
        if (mode->stuck[k]) {
            mechc_contact_unknown(nu, tangent, tangent, 0.0, a + count * nu, b + count * nu);
            aim[count++] = -c->slipping[k];
        } else if (!c->has_gap[k])
            for (int j = 0; j < nu; j++) given[j] -= slope * tangent[j];
    }
    return count;
}

static double mechc_contact_dot(const double *a, const double *b, int n)
{
    double sum = 0.0;
    for (int j = 0; j < n; j++) sum += a[j] * b[j];
    return sum;
}

/* The rates in a mode, at the place at hand. */
static void mechc_contact_set_rates(mechc_contact *c, const mechc_contact_mode *mode)
{
    const int nq = c->coordinates, nu = c->speeds, most = 2 * c->contacts;
    double *a = c->space + 3 * (nq + nu) + c->rows * (nu + 1), *b = a + most * nu;
    double *matrix = b + most * nu, *aim = matrix + most * most, *found = aim + 2 * most;
    double *along = found + most;
    mechc_contact_set_free(c);
    const int count = mechc_contact_unknowns(c, mode, a, b, aim, along);
    for (int i = 0; i < count; i++) {
        aim[i] -= mechc_contact_dot(a + i * nu, along, nu);
        for (int k = 0; k < count; k++)
            matrix[i * count + k] = mechc_contact_dot(a + i * nu, b + k * nu, nu);
    }
    mechc_least_change(matrix, aim, count, count, MECHC_CONTACT_DEPENDENT, aim + count, found);
    for (int i = 0; i < count; i++)
        for (int j = 0; j < nu; j++) along[j] += found[i] * b[i * nu + j];
    mechc_solve_upper(c->root, nu, along);
    memcpy(c->rates, c->free, (size_t)(nq + nu) * sizeof(double));
    for (int j = 0; j < nu; j++) c->rates[nq + j] += along[j];
}

/* The state at hand moved onto a mode's constraints, and its rates. */
static int mechc_contact_settle(mechc_contact *c, const mechc_contact_mode *mode)
{
    int status = mechc_contact_onto_gaps(c, mode->closed);
    if (status == MECHC_RUNNING) status = mechc_contact_with_speeds(c, mode->closed, mode->stuck);
    if (status == MECHC_RUNNING) mechc_contact_set_rates(c, mode);
    return status;
}
