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
