/* States of a piece in contact, evaluated after its motion has ended. */
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

/* States on the constraints of the piece's mode, by a motion of the same scene and the laws of its
 * contacts; NaN if the constraints cannot be satisfied.  0 without memory. */
MECHC_STATIC int mechc_read_contact(const mechc_motion *of, const mechc_contact_laws *laws,
                              const mechc_piece *piece, ptrdiff_t count, const double *t, double *y)
{
    mechc_motion motion = *of;
    mechc_contact_place place = {0};
    int made = mechc_motion_make(&motion, 1);
    if (made) {
        memcpy(motion.p, piece->p, (size_t)motion.parameters * sizeof *motion.p);
        mechc_motion_renew(&motion);
        made = mechc_contact_make(&place, &motion, laws);
    }
    if (made) motion.unit->interpolate(0, piece->steps, motion.p, motion.inputs, count, t, y);
    for (ptrdiff_t i = 0; made && i < count; i++, y += motion.width)
        if (mechc_contact_settle(&place, piece->contact, t[i], y) != MECHC_RUNNING)
            for (int j = 0; j < motion.width; j++) y[j] = NAN;
    mechc_contact_free(&place);
    mechc_motion_free(&motion);
    return made;
}
