/* The decision in which mode a motion goes on: which contacts open, are held, stick or slide.
 *
 * A mode is consistent where gaps press and do not pull, friction stays within its limit and opposes
 * the sliding, and open gaps open: a complementarity problem on accelerations.  Its solutions are found
 * by trying the modes, so that it is known where there is none, or more than one (Painleve 1895).
 */
#pragma once

#include "abi/codes.h"
#include "hybrid/contact/margin.h"

#define MECHC_MODES_DIFFER 1e-6 /* of the largest acceleration: two modes so far apart are two motions */
#define MECHC_MOST_MODES 4096   /* that are tried */
#define MECHC_MODE_ROUND 1e-11  /* of a coefficient: friction that is larger by more */

/* An enumeration of modes: for each contact its possible states, in order. */
typedef struct {
    int contacts;
    unsigned char (*state)[4], *count, *at, *mode;
} mechc_choices;

/* The conditions for a consistent mode: which gaps have to stay closed or to open, and for contacts
 * without slip the direction in which one that begins to slide moves. */
typedef struct {
    const unsigned char *closed, *still;
} mechc_demands;

MECHC_STATIC void mechc_choices_free(mechc_choices *choices) { free(choices->state); }

MECHC_STATIC int mechc_choices_make(mechc_choices *choices, int contacts)
{
    const size_t n = (size_t)contacts;
    choices->contacts = contacts;
    choices->state = malloc(7 * n + 1);
    choices->count = choices->state ? (unsigned char *)(choices->state + n) : 0;
    choices->at = choices->count + n;
    choices->mode = choices->at + n;
    return choices->state != 0;
}

MECHC_STATIC void mechc_choose_state(mechc_choices *choices, int contact, mechc_contact_state state)
{
    choices->state[contact][choices->count[contact]++] = (unsigned char)state;
}

/* Set the possible states of each contact: closed gaps, and still or sliding ones among them.  A gap that
 * neither presses nor opens is open, so that no force is computed that is only rounding. */
MECHC_STATIC void mechc_choose_states(mechc_choices *choices, const mechc_demands *demands,
                                const double *slip, const unsigned char *has_gap,
                                const unsigned char *has_friction)
{
    for (int k = 0; k < choices->contacts; k++) {
        choices->count[k] = 0;
        if (has_gap[k]) mechc_choose_state(choices, k, MECHC_OPEN);
        if (has_gap[k] && !demands->closed[k]) continue;
        if (!has_friction[k]) mechc_choose_state(choices, k, MECHC_HELD);
        else if (!demands->still[k])
            mechc_choose_state(choices, k, slip[k] > 0.0 ? MECHC_SLIDES_ON : MECHC_SLIDES_BACK);
        else {
            mechc_choose_state(choices, k, MECHC_STICKS);
            mechc_choose_state(choices, k, MECHC_SLIDES_ON);
            mechc_choose_state(choices, k, MECHC_SLIDES_BACK);
        }
    }
}

/* Begin with the first mode; 0 if there are too many modes. */
MECHC_STATIC int mechc_first_mode(mechc_choices *choices)
{
    double modes = 1.0;
    for (int k = 0; k < choices->contacts; k++) {
        modes *= choices->count[k];
        choices->at[k] = 0;
        choices->mode[k] = choices->state[k][0];
    }
    return modes <= MECHC_MOST_MODES;
}

/* Go to the next mode, changing the last contact first; 0 after the last mode. */
MECHC_STATIC int mechc_next_mode(mechc_choices *choices)
{
    for (int k = choices->contacts - 1; k >= 0; k--) {
        const int more = ++choices->at[k] < choices->count[k];
        if (!more) choices->at[k] = 0;
        choices->mode[k] = choices->state[k][choices->at[k]];
        if (more) return 1;
    }
    return 0;
}

MECHC_STATIC int mechc_is_consistent(const mechc_answer *answer, const mechc_demands *demands,
                               mechc_limit *limit)
{
    const double small = MECHC_CONTACT_EXACT * answer->size;
    if (!mechc_answer_solves(answer) || mechc_answer_margin(answer, limit) < -small) return 0;
    for (int k = 0; k < answer->of->n; k++) {
        const double way = mechc_way(answer->mode[k]);
        if (answer->mode[k] == MECHC_OPEN && demands->closed[k] && answer->opening[k] < -small) return 0;
        if (way != 0.0 && demands->still[k] && way * answer->sliding[k] < -small) return 0;
    }
    return 1;
}

/* Whether two modes differ only by contacts that stick in one, with more friction than in sliding. */
MECHC_STATIC int mechc_differ_by_sticking(const mechc_problem *of, const unsigned char *a, const unsigned char *b)
{
    int all = 1;
    for (int k = 0; k < of->n; k++) {
        const int sticks = a[k] == MECHC_STICKS || b[k] == MECHC_STICKS;
        const int open = a[k] == MECHC_OPEN || b[k] == MECHC_OPEN;
        const int more = of->sticking[k] > of->friction[k] * (1.0 + MECHC_MODE_ROUND);
        all &= a[k] == b[k] || (sticks && !open && more);
    }
    return all;
}

/* The first of several consistent modes, with its forces and accelerations. */
typedef struct {
    unsigned char *mode;
    double *after; /* accelerations of gaps and slips (2 n) */
    int found, several; /* others do something else */
} mechc_candidate;

MECHC_STATIC void mechc_candidate_take(mechc_candidate *candidate, const mechc_answer *answer)
{
    const mechc_problem *of = answer->of;
    const size_t n = (size_t)of->n;
    if (!candidate->found++) {
        memcpy(candidate->mode, answer->mode, n);
        memcpy(candidate->after, answer->opening, n * sizeof(double));
        memcpy(candidate->after + n, answer->sliding, n * sizeof(double));
        return;
    }
    double change = 0.0;
    for (size_t k = 0; k < n; k++) {
        change = fmax(change, fabs(answer->opening[k] - candidate->after[k]));
        change = fmax(change, fabs(answer->sliding[k] - candidate->after[n + k]));
    }
    candidate->several |= change > MECHC_MODES_DIFFER * answer->size
                       && !mechc_differ_by_sticking(of, candidate->mode, answer->mode);
}

/* Decide the mode in which the motion goes on, mode (n). `left_by`: a contact, -1: none, that has
 * reached the limit of these states (bits by their numbers); they are used only if nothing else is
 * consistent.  Sticking precedes sliding if both are consistent, which a larger static friction
 * allows.  Returns MECHC_RUNNING, or why there is no decision. */
MECHC_STATIC int mechc_decide(const mechc_problem *of, mechc_answer *answer, mechc_choices *choices,
                        const mechc_demands *demands, int left_by, unsigned left, unsigned char *mode)
{
    const size_t n = (size_t)of->n;
    if (!mechc_first_mode(choices)) return MECHC_CONTACTS_TOO_MANY;
    double *after = malloc(4 * n * sizeof *after + 2 * n + 2 * n * sizeof(mechc_limit) + 1);
    if (!after) return MECHC_NO_MEMORY;
    mechc_limit *limit = (mechc_limit *)(after + 4 * n);
    unsigned char *modes = (unsigned char *)(limit + 2 * n);
    mechc_candidate candidate[2] = {{modes, after, 0, 0}, {modes + n, after + 2 * n, 0, 0}};
    do {
        mechc_answer_of(answer, of, choices->mode);
        if (mechc_is_consistent(answer, demands, limit))
            mechc_candidate_take(candidate + (left_by >= 0 && left >> choices->mode[left_by] & 1), answer);
    } while (mechc_next_mode(choices));
    const mechc_candidate *first = candidate + (candidate[0].found ? 0 : 1);
    const int status = !first->found ? MECHC_CONTACT_INCONSISTENT
                     : first->several ? MECHC_CONTACT_UNDECIDED : MECHC_RUNNING;
    if (first->found) memcpy(mode, first->mode, n);
    free(after);
    return status;
}
