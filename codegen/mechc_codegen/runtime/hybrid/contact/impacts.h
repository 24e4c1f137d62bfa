/* Impacts with friction: impulses at all contacts that touch.
 *
 * Newton's law of restitution for the rates of the gaps and Coulomb's for the impulses (Moreau 1988;
 * Glocker & Pfeiffer 1995, Nonlinear Dynamics 7), one complementarity problem: w+ + e w >= 0,
 * p >= 0, their product 0, and |p_t| <= mu p, opposite to the slip after the impact where that is not
 * 0.  Newton's law with friction may give energy (Kane & Levinson 1985); then the restitution is
 * taken as much smaller as keeps it from that.  With e = 0 it never does: p^T w+ <= 0.
 *
 * Poisson's law has two such problems (Glocker & Pfeiffer, the same).  Compression is that of e = 0,
 * with the impulses c.  Expansion has p = e c + x, x >= 0 and w+ >= 0, their product 0, and friction
 * within mu p.  With one e for all it never gives energy: compression takes c^T A c / 2 and more, e c
 * with e c_t give at most e^2 of it, and what x and the friction of expansion add has p^T w+ <= 0.
 */
#pragma once

#include "hybrid/contact/decide.h"
#include "hybrid/contact/impulses.h"

#define MECHC_RESTITUTION_HALVINGS 52
#define MECHC_ENERGY_ROUND 1e-13   /* of the energy exchanged */
#define MECHC_AFTER_IMPACT 1e-12   /* of the largest rate or slip: one so small is 0 */

/* An impact of n contacts that touch. `has_friction` (n).  Results: impulses along the normals (n), changes
 * along rows R (nu), and the fraction of the restitution that counted, so that no energy was gained. */
typedef struct {
    mechc_problem problem; /* closing, slipping: rates of gaps and slips before */
    const double *restitution;
    const unsigned char *has_friction;
    double *pressed, *change, kept;
    mechc_answer *answer;
    mechc_choices *choices;
    double *space; /* 7 n + nu numbers, 3 n bytes */
} mechc_impact;

/* The solution of a problem that leaves the least energy, computed from the rates before: its
 * impulses, changes and energy. */
typedef struct {
    double *normal, *friction, *change, energy;
    int found;
} mechc_solution;

/* The energy that impulses add, J. */
MECHC_STATIC double mechc_answer_energy(const mechc_problem *before, const mechc_answer *answer)
{
    double energy = 0.5 * mechc_inner_product(answer->along, answer->along, before->nu), normal, friction;
    for (int k = 0; k < before->n; k++) {
        mechc_answer_forces(answer, k, &normal, &friction);
        energy += normal * before->closing[k] + friction * before->slipping[k];
    }
    return energy;
}

MECHC_STATIC void mechc_solution_take(mechc_solution *solution, const mechc_problem *before,
                                const mechc_answer *answer)
{
    const double energy = mechc_answer_energy(before, answer);
    if (solution->found && !(energy < solution->energy)) return;
    solution->found = 1;
    solution->energy = energy;
    for (int k = 0; k < before->n; k++)
        mechc_answer_forces(answer, k, solution->normal + k, solution->friction + k);
    memcpy(solution->change, answer->along, (size_t)before->nu * sizeof(double));
}

/* The size of the energies that impulses add and remove, J. */
MECHC_STATIC double mechc_exchanged(const mechc_problem *before, const mechc_solution *solution)
{
    double sum = 0.0;
    for (int k = 0; k < before->n; k++)
        sum += fabs(solution->normal[k] * before->closing[k])
             + fabs(solution->friction[k] * before->slipping[k]);
    return sum;
}

/* Try all modes of the current choices. */
MECHC_STATIC int mechc_solve_impact(const mechc_impact *impact, const mechc_problem *before,
                              const mechc_problem *of, const mechc_demands *demands, int opens,
                              mechc_solution *solution)
{
    mechc_limit *limit = malloc((2 * (size_t)of->n + 1) * sizeof *limit);
    if (!limit) return MECHC_NO_MEMORY;
    int status = mechc_first_mode(impact->choices) ? MECHC_RUNNING : MECHC_CONTACTS_TOO_MANY;
    while (status == MECHC_RUNNING) {
        mechc_answer_of(impact->answer, of, impact->choices->mode);
        int fits = mechc_is_consistent(impact->answer, demands, limit);
        for (int k = 0; k < of->n && opens; k++)
            fits &= impact->answer->opening[k] >= -MECHC_CONTACT_EXACT * impact->answer->size;
        if (fits) mechc_solution_take(solution, before, impact->answer);
        if (!mechc_next_mode(impact->choices)) break;
    }
    free(limit);
    return status;
}

/* -- Newton's law ------------------------------------------------------------------------------ */

/* Solve the impact with a fraction of the restitution. */
MECHC_STATIC int mechc_impact_with(const mechc_impact *impact, double part, mechc_solution *solution)
{
    const mechc_problem *before = &impact->problem;
    const int n = before->n;
    double *closing = impact->space;
    unsigned char *all = (unsigned char *)(impact->space + 7 * n + before->nu);
    mechc_problem of = *before;
    memset(all, 1, (size_t)n);
    for (int k = 0; k < n; k++)
        closing[k] = (1.0 + part * impact->restitution[k]) * before->closing[k];
    of.closing = closing;
    solution->found = 0;
    const mechc_demands demands = {all, all};
    mechc_choose_states(impact->choices, &demands, before->slipping, all, impact->has_friction);
    const int status = mechc_solve_impact(impact, before, &of, &demands, 0, solution);
    return status == MECHC_RUNNING && !solution->found ? MECHC_CONTACT_INCONSISTENT : status;
}

MECHC_STATIC int mechc_gives_energy(const mechc_problem *before, const mechc_solution *solution)
{
    return solution->energy > MECHC_ENERGY_ROUND * mechc_exchanged(before, solution);
}

/* Find the largest fraction of the restitution that adds no energy, and its impulses. */
MECHC_STATIC int mechc_newton_impact(mechc_impact *impact, mechc_solution *solution)
{
    int status = mechc_impact_with(impact, 1.0, solution);
    double low = 0.0, high = 1.0;
    impact->kept = 1.0;
    if (status != MECHC_RUNNING || !mechc_gives_energy(&impact->problem, solution)) return status;
    for (int i = 0; i < MECHC_RESTITUTION_HALVINGS && status == MECHC_RUNNING; i++) {
        impact->kept = 0.5 * (low + high);
        status = mechc_impact_with(impact, impact->kept, solution);
        if (solution->energy > 0.0) high = impact->kept;
        else low = impact->kept;
    }
    impact->kept = low;
    return status == MECHC_RUNNING ? mechc_impact_with(impact, low, solution) : status;
}

/* -- Poisson's law ----------------------------------------------------------------------------- */

/* Try all solutions in which these contacts press more than restitution demands. */
MECHC_STATIC int mechc_expand_with(const mechc_impact *impact, const mechc_problem *begun,
                             const unsigned char *pressed, mechc_solution *solution)
{
    const int n = begun->n;
    double *friction = impact->space + 4 * n;
    unsigned char *all = (unsigned char *)(impact->space + 7 * n + begun->nu), *rubs = all + 2 * n;
    mechc_problem of = *begun;
    memset(all, 1, (size_t)n);
    for (int k = 0; k < n; k++) {
        const double limit = begun->friction[k] * begun->restored[k];
        friction[k] = pressed[k] ? begun->friction[k] : limit;
        rubs[k] = impact->has_friction[k] && (pressed[k] || limit > 0.0);
    }
    of.friction = of.sticking = friction;
    of.has_gap = pressed;
    const mechc_demands demands = {all, all};
    mechc_choose_states(impact->choices, &demands, begun->slipping, pressed, rubs);
    for (int k = 0; k < n; k++) { /* none is open */
        mechc_choices *choices = impact->choices;
        if (choices->state[k][0] != MECHC_OPEN) continue;
        memmove(choices->state[k], choices->state[k] + 1, --choices->count[k]);
    }
    return mechc_solve_impact(impact, begun, &of, &demands, 1, solution);
}

/* Go to the next set of `count` out of n; 0 after the last one. */
MECHC_STATIC int mechc_next_set(unsigned char *set, int n)
{
    int ones = 0, k = n - 1;
    while (k >= 0 && set[k]) ones++, k--;
    while (k >= 0 && !set[k]) k--;
    if (k < 0) return 0;
    set[k] = 0;
    memset(set + k + 1, 0, (size_t)(n - k - 1));
    memset(set + k + 1, 1, (size_t)ones + 1);
    return 1;
}

/* The impulses of expansion.  Among all solutions take one with the fewest contacts that press more
 * than restitution demands; with much friction they may do so without need (Painleve 1895). */
MECHC_STATIC int mechc_expand(const mechc_impact *impact, const mechc_problem *begun, mechc_solution *solution)
{
    const int n = begun->n;
    unsigned char *pressed = (unsigned char *)(impact->space + 7 * n + begun->nu) + n;
    double modes = 1.0;
    for (int k = 0; k < n; k++) modes *= impact->has_friction[k] ? 6 : 2;
    if (modes > MECHC_MOST_MODES) return MECHC_CONTACTS_TOO_MANY;
    solution->found = 0;
    for (int count = 0; count <= n && !solution->found; count++) {
        memset(pressed, 0, (size_t)n);
        memset(pressed, 1, (size_t)count);
        do {
            const int status = mechc_expand_with(impact, begun, pressed, solution);
            if (status != MECHC_RUNNING) return status;
        } while (mechc_next_set(pressed, n));
    }
    return solution->found ? MECHC_RUNNING : MECHC_CONTACT_INCONSISTENT;
}

/* Solve the impact by Poisson's law; if different restitutions add energy, the least counts for all. */
MECHC_STATIC int mechc_poisson_impact(mechc_impact *impact, mechc_solution *solution)
{
    const mechc_problem *before = &impact->problem;
    const int n = before->n, nu = before->nu;
    double *rates = impact->space + n, *slips = rates + n, *restored = slips + n;
    double *pressed = restored + 2 * n, *change = impact->space + 7 * n, least = HUGE_VAL, most = 0.0;
    int status = mechc_impact_with(impact, 0.0, solution);
    impact->kept = 1.0;
    for (int k = 0; k < n; k++) {
        least = fmin(least, impact->restitution[k]);
        most = fmax(most, impact->restitution[k]);
    }
    if (status != MECHC_RUNNING || !(most > 0.0)) return status;
    const double compression = solution->energy, exchanged = mechc_exchanged(before, solution);
    const double small = MECHC_AFTER_IMPACT * mechc_problem_size(before);
    memcpy(pressed, solution->normal, (size_t)n * sizeof(double));
    memcpy(change, solution->change, (size_t)nu * sizeof(double));
    for (int k = 0; k < n; k++) {
        rates[k] = before->closing[k] + mechc_inner_product(before->normal + k * nu, change, nu);
        slips[k] = before->slipping[k] + mechc_inner_product(before->tangent + k * nu, change, nu);
        if (fabs(rates[k]) <= small) rates[k] = 0.0;
        if (fabs(slips[k]) <= small) slips[k] = 0.0;
    }
    mechc_problem begun = *before;
    begun.closing = rates;
    begun.slipping = slips;
    begun.restored = restored;
    for (int same = 0; same < 2; same++) {
        for (int k = 0; k < n; k++)
            restored[k] = (same ? least : impact->restitution[k]) * fmax(pressed[k], 0.0);
        status = mechc_expand(impact, &begun, solution);
        if (status != MECHC_RUNNING) return status;
        if (compression + solution->energy <= MECHC_ENERGY_ROUND * exchanged) break;
    }
    for (int k = 0; k < n; k++) solution->normal[k] += pressed[k];
    for (int j = 0; j < nu; j++) solution->change[j] += change[j];
    return status;
}

/* -- any impact -------------------------------------------------------------------------------- */

/* Solve an impact without friction. */
MECHC_STATIC int mechc_plain_impact(mechc_impact *impact, int poisson)
{
    const mechc_problem *of = &impact->problem;
    const int n = of->n, nu = of->nu;
    double *a = malloc((size_t)(n * (2 * n + 7) + 1) * sizeof *a);
    int *sets = malloc((2 * (size_t)n + 1) * sizeof *sets), found = 0;
    for (int i = 0; i < n && a; i++)
        for (int k = 0; k < n; k++)
            a[i * n + k] = mechc_inner_product(of->normal + i * nu, of->normal + k * nu, nu);
    const int status = a && sets ? MECHC_RUNNING : MECHC_NO_MEMORY;
    if (status == MECHC_RUNNING)
        found = mechc_impulses(a, of->closing, impact->restitution, n, poisson, impact->pressed,
                               a + n * n, sets);
    memset(impact->change, 0, (size_t)nu * sizeof(double));
    for (int k = 0; k < n && found; k++)
        for (int j = 0; j < nu; j++)
            impact->change[j] += impact->pressed[k] * of->normal[k * nu + j];
    free(a);
    free(sets);
    return status == MECHC_RUNNING && !found ? MECHC_CONTACT_INCONSISTENT : status;
}

/* The impulses at the contacts that touch; MECHC_RUNNING, or why there are none. */
MECHC_STATIC int mechc_impact_impulses(mechc_impact *impact, int poisson)
{
    int friction = 0;
    impact->kept = 1.0;
    for (int k = 0; k < impact->problem.n; k++) friction |= impact->has_friction[k];
    if (!friction) return mechc_plain_impact(impact, poisson);
    double *rubbed = impact->space + 6 * impact->problem.n;
    mechc_solution solution = {impact->pressed, rubbed, impact->change, 0.0, 0};
    return (poisson ? mechc_poisson_impact : mechc_newton_impact)(impact, &solution);
}
