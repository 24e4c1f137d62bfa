/* One state, moved to the nearest one on the constraints. */

/* moved[0], moved[1]: largest closure gap and largest velocity residual found before. */
MECHC_ONCE int mechc_project_state(double t, double *y, const double *p, const double *k,
                                   double *moved)
{
    mechc_scalar_place place;
    long iterations = 0;
    moved[0] = moved[1] = 0.0;
#if MECHC_NH > 0
    double rounding;
    mechc_scalar_locate(t, y, p, k, &place);
    moved[0] = mechc_scalar_gap(&place, y, &rounding);
#endif
    const int status = mechc_scalar_close_loops(t, y, p, k, &place, &iterations);
#if MECHC_NC > 0
    double residual[MECHC_NC];
    if (status == MECHC_RUNNING) {
        mechc_scalar_velocity_residual(&place, y + MECHC_NQ, residual);
        for (int i = 0; i < MECHC_NC; i++) moved[1] = fmax(moved[1], fabs(residual[i]));
        mechc_scalar_steady(&place, y + MECHC_NQ);
    }
#endif
    return status;
}

#if MECHC_NC > 0
/* Conditioning, squared, below which a row says nothing that rounding has not said louder. */
#define MECHC_WEAK 1e-11

/* Leave the rows out that are that weak; returns how many. */
MECHC_STATIC int mechc_forget_weak(mechc_scalar_factors *f)
{
    int weak = 0;
    for (int i = 1; i < MECHC_NC; i++)
        if (f->norm[i] < MECHC_WEAK * f->norm[0]) f->inverse_norm[i] = 0.0, weak++;
    return weak;
}
#endif

/* A state between accepted ones.  On a crossing itself the weakest row would turn the rounding of
 * the closure into speeds; there the polynomial is already as good as its steps. */
MECHC_ONCE int mechc_project_between(double t, double *y, const double *p, const double *k)
{
#if MECHC_NC > 0
    mechc_scalar_place place;
    mechc_scalar_locate(t, y, p, k, &place);
    int weak = mechc_forget_weak(&place.all);
#if MECHC_NH > 0
    double before = HUGE_VAL, rounding, gap = mechc_scalar_gap(&place, y, &rounding);
    for (int iteration = 0; gap > rounding && iteration < 20; iteration++) {
        if (!(gap < HUGE_VAL)) return MECHC_NOT_FINITE;
        if ((weak || gap <= 16.0 * rounding) && gap >= 0.25 * before) break;
        before = gap;
        mechc_scalar_correct(t, y, p, k, &place);
        mechc_scalar_locate(t, y, p, k, &place);
        weak = mechc_forget_weak(&place.all);
        gap = mechc_scalar_gap(&place, y, &rounding);
    }
    if (!(gap <= 16.0 * rounding || weak)) return MECHC_NOT_CLOSED;
#endif
    mechc_scalar_steady(&place, y + MECHC_NQ);
#else
    (void)t, (void)y, (void)p, (void)k;
#endif
    return MECHC_RUNNING;
}
