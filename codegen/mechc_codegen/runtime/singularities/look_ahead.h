/* How collocation comes up to a crossing: looked for before a step is tried, so that the step
 * straddles it with the crossing in a wide gap between its nodes, or ends well before it.
 */

#if MECHC_NH > 0
/* Time until the motion, on a parabola from here, is nearest to q*; infinite where it leads away
 * from it or past it. */
MECHC_STATIC double mechc_rk_time_to(const mechc_rk_run *run, const mechc_critical *c)
{
    double away = 0.0, square = 0.0, bend = 0.0;
    for (int i = 0; i < MECHC_NQ; i++) {
        const double weight = mechc_weight(c, i), rate = run->direction * MECHC_RATE(run, 0)[i];
        away += weight * (c->q[i] - run->y[i]) * rate;
        square += weight * rate * rate;
#if MECHC_IDENTITY_KINEMATICS
        bend += 0.5 * weight * MECHC_RATE(run, 0)[MECHC_NQ + i] * rate;
#endif
    }
    if (!(away > 0.0 && square > 0.0)) return HUGE_VAL;
    const double discriminant = square * square + 4.0 * bend * away;
    return discriminant > 0.0 ? 2.0 * away / (square + sqrt(discriminant)) : HUGE_VAL;
}

/* Steps within which the conditioning, falling on as it does, would be gone. */
#define MECHC_SOON 4.0

/* Gap over the length below which a near miss is passed in a bend so sharp that the iteration
 * would magnify rounding there. */
#define MECHC_SHARP 1e-6

/* Time to the next crossing, looked for where the conditioning is as poor as it is beside one. */
MECHC_STATIC double mechc_rk_look_ahead(mechc_rk_run *run, double open)
{
    mechc_critical critical;
    mechc_scalar_place place;
    const mechc_span span = {.h = run->direction * open, .start = run->y, .end = run->y,
                             .start_rates = MECHC_RATE(run, 0)};
    const mechc_dip *dip = &run->dip;
    const int falls = !dip->leaving
                   && (dip->fall == 0.0 || dip->first < MECHC_SOON * open * dip->fall);
    if (dip->first > MECHC_CLEAR || (dip->first > MECHC_NARROW && !falls)) return HUGE_VAL;
    mechc_place_at(run->head.t, run->y, run->p, run->k, &place);
    mechc_weakest weakest;
    mechc_find_weakest(place.jacobian, place.mass, run->dip.rank, &weakest);
    const double reach =
        mechc_max(2.0 * mechc_reach(&span, place.mass), mechc_beside(&weakest, place.mass));
    if (!mechc_find_near(run->head.t, run->y, run->p, run->k, &run->dip, reach, &critical))
        return HUGE_VAL;
    const double ahead = mechc_rk_time_to(run, &critical);
    if (mechc_judge(&critical) == MECHC_CROSSING) return ahead;
    const int bend = fabs(critical.gap) < MECHC_SHARP * critical.rounding / MECHC_EPS;
    run->dip.bends = bend && (ahead < 1.5 * open || dip->first < MECHC_NARROW);
    return HUGE_VAL;
}
#endif

/* How long a step the last one's polynomial may begin where stages begun far off would close on
 * the other branch. */
MECHC_STATIC double mechc_gauss_reach(const struct mechc_gauss *g)
{
    if (g->last_step == 0.0) return HUGE_VAL;
    return fabs(g->last_step) * mechc_min(3.0, mechc_max(1.3, 0.9 * g->last_factor));
}

/* A step, as a rule no longer than `open`, that keeps well away from crossings ahead or straddles
 * them well. */
MECHC_STATIC double mechc_rk_approach(mechc_rk_run *run, double open)
{
#if MECHC_NH > 0
    mechc_dip *dip = &run->dip;
    if (isnan(dip->ahead)) dip->ahead = mechc_rk_look_ahead(run, open);
    /* so near that noise grows with every step that ends before it: over it at once */
    if (dip->first < MECHC_NARROW && dip->ahead < HUGE_VAL && !run->refused)
        open = mechc_max(open, 2.0 * dip->ahead);
    if (dip->ahead >= 1.5 * open) return open;
    const double fit = mechc_min(open, mechc_gauss_reach(run->collocation));
    const double planned = mechc_plan(run->tableau, dip->ahead, fit);
    if (planned < open && !dip->wanted) dip->wanted = open;
    return planned;
#else
    (void)run;
    return open;
#endif
}

/* Leave what comes to the explicit pair. */
MECHC_STATIC void mechc_rk_leave_to_pair(mechc_rk_run *run, double h)
{
    run->resume = run->own;
    run->step = 0.25 * fabs(h);
    run->dip.wanted = 0.0;
    run->dip.bends = 0;
    mechc_rk_use(run, &MECHC_BRIDGE);
}

/* Where several rows are weak together, and in the bend of a near miss, the iteration magnifies
 * rounding more than an explicit step does.  1 where the pair is to go on. */
MECHC_STATIC int mechc_rk_step_aside(mechc_rk_run *run, double h)
{
    const int here = MECHC_NH > 0 && (run->dip.ahead < fabs(h) || run->dip.first < MECHC_CLEAR);
    if (!here || ++run->missed < 2) return 0;
    mechc_rk_refuse(run, 1.0);
    mechc_rk_leave_to_pair(run, h);
    return 1;
}

/* Past it: back to the method asked for. */
MECHC_STATIC void mechc_rk_come_back(mechc_rk_run *run)
{
    run->missed = 0;
    if (!run->resume) return;
    mechc_rk_use(run, run->resume);
    run->collocation->last_step = run->collocation->last_factor = 0.0;
    memset(run->collocation->low, 0, sizeof run->collocation->low);
    run->resume = 0;
}
