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
        for (int i = 0; i < MECHC_NC; i++) moved[1] = mechc_max(moved[1], fabs(residual[i]));
        mechc_scalar_steady(&place, y + MECHC_NQ);
    }
#endif
    return status;
}

#if MECHC_NC > 0
/* Conditioning, squared, below which a row says nothing that rounding has not said louder. */
#define MECHC_WEAK 1e-11

/* The rows at q without those that are that weak; returns how many these are. */
MECHC_ONCE int mechc_strong_rows(double t, const double *q, const double *p, const double *k,
                                   mechc_scalar_place *place, mechc_scalar_factors *rows)
{
    int weak = 0;
    mechc_scalar_configuration(t, q, p, k, place->gap, place->jacobian, place->bias, place->mass,
                               place->saved, 0, 0);
    mechc_scalar_factor_rows(place->jacobian, place->mass, MECHC_NC, rows);
    for (int i = 1; i < MECHC_NC; i++)
        if (rows->norm[i] < MECHC_WEAK * rows->norm[0]) rows->inverse_norm[i] = 0.0, weak++;
    return weak;
}
#endif

/* A state between accepted ones.  On a crossing itself the weakest row would turn the rounding of
 * the closure into speeds; there the polynomial is already as good as its steps. */
MECHC_ONCE int mechc_project_between(double t, double *y, const double *p, const double *k)
{
#if MECHC_NC > 0
    mechc_scalar_place place;
    mechc_scalar_factors rows;
    double values[MECHC_NC], step[MECHC_NU];
#if MECHC_NH > 0
    double before = HUGE_VAL, rounding, gap;
    int weak;
    for (int iteration = 0;; iteration++) {
        weak = mechc_strong_rows(t, y, p, k, &place, &rows);
        gap = mechc_scalar_gap(&place, y, &rounding);
        if (!(gap < HUGE_VAL)) return MECHC_NOT_FINITE;
        if (gap <= rounding || iteration == 20) break;
        if ((weak || gap <= 16.0 * rounding) && gap >= 0.25 * before) break;
        before = gap;
        mechc_scalar_gap_values(&place, values);
        mechc_scalar_least_change(&rows, MECHC_NC, values, step);
        mechc_scalar_displace(t, y, p, k, step);
    }
    if (!(gap <= 16.0 * rounding || weak)) return MECHC_NOT_CLOSED;
#else
    mechc_strong_rows(t, y, p, k, &place, &rows);
#endif
    mechc_scalar_velocity_residual(&place, y + MECHC_NQ, values);
    for (int i = 0; i < MECHC_NC; i++) values[i] = -values[i];
    mechc_scalar_least_change(&rows, MECHC_NC, values, step);
    for (int i = 0; i < MECHC_NU; i++) y[MECHC_NQ + i] += step[i];
#else
    (void)t, (void)y, (void)p, (void)k;
#endif
    return MECHC_RUNNING;
}
