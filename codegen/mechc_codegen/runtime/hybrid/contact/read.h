/* States and forces of a piece in contact, evaluated after its motion has ended. */
#pragma once

#include "hybrid/contact/manifold.h"
#include "record/piece.h"

/* Whether a contact lasts in a piece. */
MECHC_STATIC int mechc_piece_in_contact(const mechc_piece *piece)
{
    int lasts = 0;
    for (int k = 0; k < piece->contacts; k++) lasts |= piece->contact[k] != MECHC_OPEN;
    return lasts;
}

/* Prepare a motion with the parameters of a piece, and the place of its contacts; 0 without memory. */
MECHC_STATIC int mechc_begin_reading(mechc_motion *motion, mechc_contact_place *place,
                                     const mechc_contact_laws *laws, const mechc_piece *piece)
{
    if (!mechc_motion_make(motion, 1)) return 0;
    memcpy(motion->p, piece->p, (size_t)motion->parameters * sizeof *motion->p);
    mechc_motion_renew(motion);
    return mechc_contact_make(place, motion, laws);
}

/* States on the constraints of the piece's mode, by a motion of the same scene and the laws of its
 * contacts; NaN if the constraints cannot be satisfied.  0 without memory. */
MECHC_STATIC int mechc_read_contact(const mechc_motion *of, const mechc_contact_laws *laws,
                              const mechc_piece *piece, ptrdiff_t count, const double *t, double *y)
{
    mechc_motion motion = *of;
    mechc_contact_place place = {0};
    const int made = mechc_begin_reading(&motion, &place, laws, piece);
    if (made) motion.unit->interpolate(0, piece->steps, motion.p, motion.inputs, count, t, y);
    for (ptrdiff_t i = 0; made && i < count; i++, y += motion.width)
        if (mechc_contact_settle(&place, piece->contact, t[i], y) != MECHC_RUNNING)
            for (int j = 0; j < motion.width; j++) y[j] = NAN;
    mechc_contact_free(&place);
    mechc_motion_free(&motion);
    return made;
}

/* The generalized forces (count, nu) of the contacts of a piece at its states; NaN where the laws cannot
 * be evaluated.  0 without memory. */
MECHC_STATIC int mechc_read_contact_forces(const mechc_motion *of, const mechc_contact_laws *laws,
                                           const mechc_piece *piece, ptrdiff_t count, const double *t,
                                           const double *y, double *forces)
{
    mechc_motion motion = *of;
    mechc_contact_place place = {0};
    mechc_answer answer = {0};
    double *friction = calloc(2 * (size_t)laws->count + 1, sizeof *friction);
    int made = friction && mechc_begin_reading(&motion, &place, laws, piece)
            && mechc_answer_make(&answer, laws->count, motion.speeds);
    const int nu = motion.speeds;
    for (ptrdiff_t i = 0; made && i < count; i++, forces += nu) {
        if (mechc_contact_motion_at(&place, t[i], y + i * motion.width) != MECHC_RUNNING) {
            for (int j = 0; j < nu; j++) forces[j] = NAN;
            continue;
        }
        const mechc_problem of_forces = mechc_problem_of_forces(&place, friction, friction + laws->count);
        mechc_forces_of(&answer, &of_forces, piece->contact);
        mechc_generalized_forces(&place, &answer, forces);
    }
    free(friction);
    mechc_answer_free(&answer);
    mechc_contact_free(&place);
    mechc_motion_free(&motion);
    return made;
}
