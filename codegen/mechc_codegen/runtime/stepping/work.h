/* The balance of kinetic energy and work over a step near a critical configuration.
 *
 * In the bend of a near miss a step's own error estimate may miss that it cut the bend short: what
 * turns the speeds there are reactions, which do no work.  d/dt (u . M u / 2) = u . M u' + u . M' u / 2
 * holds of any motion and has no reactions in it, so that it varies slowly even there.
 */
#pragma once

#include "stepping/control.h"

#define MECHC_WORK_MOVE 1e-5  /* scales, over which the rate of M is a difference */
#define MECHC_WORK_LOST 1e-10 /* of the kinetic energy, to rounding */
#define MECHC_WORK_VARIES 0.1 /* of the power over a step, in any case */

#if MECHC_NH_MAX > 0
/* One end of a step: kinetic energy, its rate, and the change of it that errors may cause. */
typedef struct {
    double kinetic, power, allowed;
} mechc_work;

/* u . M u / 2 of the configuration that the rates lead to within a time. */
MECHC_STATIC double mechc_kinetic_after(const mechc_integration *run, double t, double time,
                                        const double *y, const double *rates, double *momenta)
{
    double q[MECHC_NQ_MAX], twice = 0.0;
    mechc_scalar_place place;
    for (int i = 0; i < MECHC_NQ; i++) q[i] = y[i] + time * rates[i];
    mechc_scalar_locate_all(t + time, q, &run->given, &place);
    for (int i = 0; i < MECHC_NU; i++) {
        momenta[i] = mechc_dot(place.mass + i * MECHC_NU, y + MECHC_NQ, MECHC_NU);
        twice += y[MECHC_NQ + i] * momenta[i];
    }
    return 0.5 * twice;
}

MECHC_STATIC mechc_work mechc_work_at(const mechc_integration *run, double t, const double *y,
                                      const double *rates, double h)
{
    double momenta[MECHC_NU_MAX], unused[MECHC_NU_MAX], fastest = 0.0;
    for (int i = 0; i < MECHC_NQ; i++)
        fastest = mechc_max(fastest, fabs(rates[i]) / run->scale[i]);
    const double time = mechc_min(MECHC_WORK_MOVE / fastest, fabs(h));
    const double after = mechc_kinetic_after(run, t, time, y, rates, unused);
    const double before = mechc_kinetic_after(run, t, -time, y, rates, unused);
    mechc_work out = {.kinetic = mechc_kinetic_after(run, t, 0.0, y, rates, momenta)};
    out.power = (after - before) / (2.0 * time) + mechc_dot(momenta, rates + MECHC_NQ, MECHC_NU);
    out.allowed = MECHC_WORK_LOST * out.kinetic;
    for (int i = 0; i < MECHC_NU; i++)
        out.allowed += fabs(momenta[i]) * mechc_tolerance(run, MECHC_NQ + i, y);
    return out;
}

/* Whether the balance holds: 0 if more is missing than the whole tolerance of the run, and than the
 * variation of the power over the step may explain. */
MECHC_STATIC int mechc_keeps_work(const mechc_integration *run, const mechc_span *span)
{
    const mechc_work a = mechc_work_at(run, span->t, span->start, span->start_rates, span->h);
    const mechc_work b = mechc_work_at(run, span->t + span->h, span->end, span->end_rates,
                                        span->h);
    const double missing = b.kinetic - a.kinetic - 0.5 * span->h * (a.power + b.power);
    const double varied = fabs(span->h) * (fabs(b.power - a.power) + MECHC_WORK_VARIES * fabs(a.power));
    return fabs(missing) <= varied + mechc_max(a.allowed, b.allowed) / run->method->share;
}
#endif
