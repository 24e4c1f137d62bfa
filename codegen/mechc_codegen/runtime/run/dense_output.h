/* Dense output, in the same form for every method:
 * y0 + s(r0 + (1-s)(r1 + s(r2 + (1-s)(r3 + ...)))) at the fraction s of a step, with r0 = y1 - y0.
 */
#pragma once

#include "singularities/generic_rank.h"
#include "dynamics/project.h"
#include "run/trajectory.h"

/* The dense output of one step at the fraction s. */
MECHC_STATIC void mechc_dense_polynomial(const double *y, const double *rows, int count, double s,
                                         double *out)
{
    double sum[MECHC_NX_MAX] = {0.0};
    for (int row = count - 1; row >= 0; row--) {
        const double factor = row % 2 ? 1.0 - s : s;
        for (int i = 0; i < MECHC_NX; i++) sum[i] = factor * (sum[i] + rows[row * MECHC_NX + i]);
    }
    for (int i = 0; i < MECHC_NX; i++) out[i] = y[i] + sum[i];
}

MECHC_STATIC void mechc_interpolate(int project, const mechc_trajectory *trajectory, const double *p,
                                    const mechc_inputs *inputs, ptrdiff_t count, const double *t,
                                    double *out)
{
    mechc_scalar_given given;
    ptrdiff_t step = 0;
    if (project) mechc_give_at(trajectory->t[0], trajectory->y, p, inputs, 0, &given);
    for (ptrdiff_t n = 0; n < count; n++, out += MECHC_NX) {
        step = mechc_step_near(trajectory, step, t[n]);
        const double start = trajectory->t[step];
        const double s = trajectory->count > 1
                       ? (t[n] - start) / (trajectory->t[step + 1] - start) : 0.0;
        const int rows = trajectory->count > 1 ? trajectory->dense_rows : 0;
        mechc_dense_polynomial(trajectory->y + step * MECHC_NX,
                            trajectory->dense + step * MECHC_NX * trajectory->dense_rows, rows, s,
                            out);
        if (project && s != 0.0 && mechc_project_between(t[n], out, &given) != MECHC_RUNNING)
            for (int i = 0; i < MECHC_NX; i++) out[i] = NAN;
    }
}
