/* Where stability, not accuracy, limits the steps: the implicit method takes over. */

/* Two states at the step's end, the last stage's and the end's own, and their rates estimate the
 * largest eigenvalue; does it times the step stay at the bound of stability?  Hairer & Wanner
 * (1996), section IV.2. */
MECHC_STATIC int mechc_rk_unstable_beyond(const mechc_rk_run *run, double h, const double *end)
{
    const mechc_tableau *tableau = run->tableau;
    const int stage = tableau->stages - 1;
    double inner[MECHC_NX], rate = 0.0, state = 0.0;
    mechc_rk_combine(run, tableau->matrix + stage * MECHC_MOST_RATES, stage, h, inner);
    for (int i = 0; i < MECHC_NX; i++) {
        const double change = MECHC_RATE(run, stage + 1)[i] - MECHC_RATE(run, stage)[i];
        rate += pow(change / run->scale[i], 2);
        state += pow((end[i] - inner[i]) / run->scale[i], 2);
    }
    return state > 0.0 && fabs(h) * sqrt(rate / state) > tableau->stability;
}

/* Fixed-point iteration that shrinks slowly on steps far more accurate than asked for. */
#define MECHC_GAUSS_SLOW 0.2
#define MECHC_GAUSS_NEEDLESS 0.01

MECHC_STATIC void mechc_rk_watch_stiffness(mechc_rk_run *run, double h, const double *end,
                                           double error)
{
    if (!run->may_stiffen || run->tableau != run->own || mechc_rk_is_implicit(run)) return;
    if (MECHC_NH > 0 && run->dip.first < MECHC_NARROW) return;
    const int limited = mechc_rk_is_collocation(run)
                      ? run->collocation->shrinking > MECHC_GAUSS_SLOW
                            && error < MECHC_GAUSS_NEEDLESS
                      : mechc_rk_unstable_beyond(run, h, end);
    run->stiff = limited ? run->stiff + 1 : run->stiff;
    run->easy = limited ? 0 : run->easy + 1;
    if (run->easy >= 6) run->stiff = 0;
}
