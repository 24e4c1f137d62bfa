/* The forces of contacts in one mode at one state, or the impulses, which follow the same law.
 *
 * A mode says of each contact whether it is open, held, sticks or slides one way.  Gaps that are kept
 * and contacts that stick need such forces that their accelerations are zero; the friction of a sliding
 * one follows from its normal force (Glocker & Pfeiffer 1995, Nonlinear Dynamics 7; in the plane).
 */
#pragma once

#include "hybrid/contact/place.h"

#define MECHC_CONTACT_EXACT 1e-9 /* of the largest acceleration: one so small is 0 */

typedef enum {
    MECHC_OPEN, MECHC_HELD, MECHC_STICKS, MECHC_SLIDES_ON, MECHC_SLIDES_BACK
} mechc_contact_state;

/* The direction of sliding, 1 or -1; 0 if the contact does not slide. */
MECHC_STATIC double mechc_way(unsigned char state)
{
    return state == MECHC_SLIDES_ON ? 1.0 : state == MECHC_SLIDES_BACK ? -1.0 : 0.0;
}

/* Rows R of gaps and slips (n, nu each); their accelerations or speeds, which are to become 0;
 * friction and static friction, as forces in N where there is no gap; normal impulses of an
 * expansion that come in addition to those sought, or NULL. */
typedef struct {
    int n, nu;
    const double *normal, *tangent, *closing, *slipping, *friction, *sticking, *restored;
    const unsigned char *has_gap;
} mechc_problem;

/* The forces x of a mode, G x = aim, and their effects. */
typedef struct {
    const mechc_problem *of;
    const unsigned char *mode;
    int count, rank;         /* of the unknowns; of G */
    int *contact, *friction; /* for each unknown: its contact, and whether it is a friction */
    double size;             /* the largest value that is to become 0, or effect of given forces */
    double *matrix, *aim, *columns, *unknown; /* G; the columns along which the unknowns act */
    double *given, *along;   /* changes along rows R (nu): by known forces, by all forces */
    double *opening, *sliding; /* afterwards (n each) */
    double *space;
    int *owners;
} mechc_answer;

MECHC_STATIC void mechc_answer_free(mechc_answer *answer)
{
    free(answer->matrix);
    free(answer->owners);
}

/* Allocate the memory for n contacts; 0 without memory. */
MECHC_STATIC int mechc_answer_make(mechc_answer *answer, int contacts, int speeds)
{
    const size_t n = (size_t)contacts, nu = (size_t)speeds, most = 2 * n;
    const mechc_part_of_room parts[] = {
        {&answer->matrix, most * most}, {&answer->aim, most}, {&answer->columns, most * nu},
        {&answer->unknown, most}, {&answer->given, nu}, {&answer->along, nu}, {&answer->opening, n},
        {&answer->sliding, n}, {&answer->space, most * (most + nu) + 3 * most},
    };
    answer->owners = malloc((3 * most + 1) * sizeof *answer->owners);
    answer->contact = answer->owners;
    answer->friction = answer->owners ? answer->owners + most : 0;
    return MECHC_ROOM_FOR(parts) && answer->owners;
}

MECHC_STATIC double mechc_problem_size(const mechc_problem *of)
{
    double size = 0.0;
    for (int k = 0; k < of->n; k++) {
        const double *normal = of->normal + k * of->nu, *tangent = of->tangent + k * of->nu;
        const double limit = of->has_gap[k] ? 0.0 : of->sticking[k];
        size = fmax(size, fmax(fabs(of->closing[k]), fabs(of->slipping[k])));
        size = fmax(size, limit * mechc_inner_product(tangent, tangent, of->nu));
        if (of->restored) size = fmax(size, of->restored[k] * mechc_inner_product(normal, normal, of->nu));
    }
    return size > 0.0 ? size : 1.0;
}

/* Add an unknown with its row; its column is reduced by a multiple of another row. */
MECHC_STATIC void mechc_answer_add(mechc_answer *answer, int contact, int friction, const double *row,
                             const double *other, double part, double target, double *rows)
{
    const int nu = answer->of->nu, i = answer->count++;
    answer->contact[i] = contact;
    answer->friction[i] = friction;
    answer->aim[i] = target;
    for (int j = 0; j < nu; j++) {
        rows[i * nu + j] = row[j];
        answer->columns[i * nu + j] = row[j] - part * other[j];
    }
}

/* Set up the unknown forces of the mode, and the effects of known ones. */
MECHC_STATIC void mechc_answer_unknowns(mechc_answer *answer, double *rows)
{
    const mechc_problem *of = answer->of;
    const int nu = of->nu;
    answer->count = 0;
    memset(answer->given, 0, (size_t)nu * sizeof(double));
    for (int k = 0; k < of->n; k++) {
        const double *normal = of->normal + k * nu, *tangent = of->tangent + k * nu;
        const double slope = mechc_way(answer->mode[k]) * of->friction[k];
        const double restored = of->restored ? of->restored[k] : 0.0;
        for (int j = 0; j < nu && of->restored; j++)
            answer->given[j] += restored * (normal[j] - (of->has_gap[k] ? slope : 0.0) * tangent[j]);
        if (of->has_gap[k] && answer->mode[k] != MECHC_OPEN)
            mechc_answer_add(answer, k, 0, normal, tangent, slope, of->closing[k], rows);
        if (answer->mode[k] == MECHC_STICKS)
            mechc_answer_add(answer, k, 1, tangent, tangent, 0.0, of->slipping[k], rows);
        else if (!of->has_gap[k])
            for (int j = 0; j < nu; j++) answer->given[j] -= slope * tangent[j];
    }
}

/* Compute the forces, whether or not the mode is consistent. */
MECHC_STATIC void mechc_forces_of(mechc_answer *answer, const mechc_problem *of, const unsigned char *mode)
{
    const int nu = of->nu;
    double *rows = answer->space, *matrix = rows + 2 * of->n * nu;
    answer->of = of;
    answer->mode = mode;
    mechc_answer_unknowns(answer, rows);
    const int n = answer->count;
    double *aim = matrix + n * n, *lengths = aim + n, longest;
    for (int i = 0; i < n; i++) {
        const double *row = rows + i * nu;
        aim[i] = answer->aim[i] = -(answer->aim[i] + mechc_inner_product(row, answer->given, nu));
        for (int k = 0; k < n; k++)
            matrix[i * n + k] = answer->matrix[i * n + k] = mechc_inner_product(row, answer->columns + k * nu, nu);
    }
    if (n) mechc_least_change(matrix, aim, n, n, MECHC_CONTACT_DEPENDENT, lengths, answer->unknown);
    longest = mechc_largest(lengths, n);
    answer->rank = 0;
    for (int i = 0; i < n; i++) answer->rank += lengths[i] > MECHC_CONTACT_DEPENDENT * longest;
    memcpy(answer->along, answer->given, (size_t)nu * sizeof(double));
    for (int i = 0; i < n; i++)
        for (int j = 0; j < nu; j++) answer->along[j] += answer->unknown[i] * answer->columns[i * nu + j];
}

/* Compute the forces and their effects. */
MECHC_STATIC void mechc_answer_of(mechc_answer *answer, const mechc_problem *of, const unsigned char *mode)
{
    const int nu = of->nu;
    mechc_forces_of(answer, of, mode);
    answer->size = mechc_problem_size(of);
    for (int k = 0; k < of->n; k++) {
        answer->opening[k] = of->closing[k] + mechc_inner_product(of->normal + k * nu, answer->along, nu);
        answer->sliding[k] = of->slipping[k] + mechc_inner_product(of->tangent + k * nu, answer->along, nu);
    }
}

/* Whether the forces are not unique. */
MECHC_STATIC int mechc_answer_is_redundant(const mechc_answer *answer)
{
    return answer->rank < answer->count;
}

MECHC_STATIC int mechc_answer_solves(const mechc_answer *answer)
{
    int solves = 1;
    for (int i = 0; i < answer->count; i++) {
        const double *row = answer->matrix + i * answer->count;
        const double off = mechc_inner_product(row, answer->unknown, answer->count) - answer->aim[i];
        solves &= fabs(off) <= MECHC_CONTACT_EXACT * answer->size;
    }
    return solves;
}

/* The normal force and the friction of a contact, N. */
MECHC_STATIC void mechc_answer_forces(const mechc_answer *answer, int contact, double *normal, double *friction)
{
    const mechc_problem *of = answer->of;
    const double way = mechc_way(answer->mode[contact]);
    *normal = *friction = 0.0;
    for (int i = 0; i < answer->count; i++)
        if (answer->contact[i] == contact) *(answer->friction[i] ? friction : normal) = answer->unknown[i];
    if (of->restored) *normal += of->restored[contact];
    if (way != 0.0) *friction = -way * of->friction[contact] * (of->has_gap[contact] ? *normal : 1.0);
}

/* The generalized forces (nu) of all contacts at their place. */
MECHC_STATIC void mechc_generalized_forces(const mechc_contact_place *c, const mechc_answer *answer, double *forces)
{
    for (int j = 0; j < c->speeds; j++) forces[j] = 0.0;
    for (int k = 0; k < c->contacts; k++) {
        const double *slip = mechc_law(c, k) + MECHC_LAWS + c->coordinates;
        double normal, friction;
        mechc_answer_forces(answer, k, &normal, &friction);
        for (int j = 0; j < c->speeds && normal != 0.0; j++)
            forces[j] += normal * mechc_gap_over_speed(c, k, j);
        for (int j = 0; j < c->speeds && friction != 0.0; j++) forces[j] += friction * slip[j];
    }
}

/* The acceleration at a contact due to one newton there. */
MECHC_STATIC double mechc_of_one_newton(const mechc_problem *of, int contact)
{
    const double *normal = of->normal + contact * of->nu, *tangent = of->tangent + contact * of->nu;
    return fmax(mechc_inner_product(normal, normal, of->nu), mechc_inner_product(tangent, tangent, of->nu));
}

/* The determinant of the sliding contacts divided by that without friction, 1 if none slides: at 0
 * and below, normal forces cannot keep gaps from closing (Painleve 1895). */
MECHC_STATIC double mechc_answer_stiffness(mechc_answer *answer)
{
    const mechc_problem *of = answer->of;
    double *part = answer->space, determinant = 1.0;
    int n = 0, *sliding = answer->owners + 4 * of->n;
    for (int i = 0; i < answer->count; i++)
        if (!answer->friction[i] && mechc_way(answer->mode[answer->contact[i]]) != 0.0) sliding[n++] = i;
    for (int i = 0; i < n; i++) {
        const double *normal = of->normal + answer->contact[sliding[i]] * of->nu;
        for (int k = 0; k < n; k++)
            part[i * n + k] = answer->matrix[sliding[i] * answer->count + sliding[k]];
        determinant /= mechc_inner_product(normal, normal, of->nu);
    }
    for (int i = 0; i < n; i++) { /* elimination with pivots */
        int pivot = i;
        for (int k = i + 1; k < n; k++)
            if (fabs(part[k * n + i]) > fabs(part[pivot * n + i])) pivot = k;
        for (int j = 0; j < n && pivot != i; j++) {
            const double kept = part[i * n + j];
            part[i * n + j] = part[pivot * n + j];
            part[pivot * n + j] = kept;
        }
        determinant *= pivot == i ? part[i * n + i] : -part[i * n + i];
        for (int k = i + 1; k < n && part[i * n + i] != 0.0; k++) {
            const double factor = part[k * n + i] / part[i * n + i];
            for (int j = i; j < n; j++) part[k * n + j] -= factor * part[i * n + j];
        }
    }
    return determinant;
}

/* The problem of the forces at a place with known accelerations. */
MECHC_STATIC mechc_problem mechc_problem_of_forces(const mechc_contact_place *c, double *friction,
                                             double *sticking)
{
    for (int k = 0; k < c->contacts; k++) {
        friction[k] = mechc_law(c, k)[MECHC_FRICTION];
        sticking[k] = mechc_law(c, k)[MECHC_STICTION];
    }
    return (mechc_problem){c->contacts, c->speeds, c->normal, c->tangent, c->opening, c->slipping,
                           friction, sticking, 0, c->laws->has_gap};
}
