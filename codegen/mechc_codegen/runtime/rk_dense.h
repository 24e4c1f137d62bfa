/* Dense output of the explicit pairs. */

/* The dense output of one step at the fraction s. */
MECHC_STATIC void mechc_rk_polynomial(const double *y, const double *rows, int count, double s,
                                      double *out)
{
    for (int i = 0; i < MECHC_NX; i++) {
        double sum = 0.0;
        for (int row = count - 1; row >= 0; row--)
            sum = (row % 2 ? 1.0 - s : s) * (sum + rows[row * MECHC_NX + i]);
        out[i] = y[i] + sum;
    }
}

static void mechc_rk_interpolate(int method, const mechc_trajectory *trajectory, const double *p,
                                 ptrdiff_t count, const double *t, double *out)
{
    (void)method;
    double k[MECHC_CONSTANTS];
    mechc_constants_at(trajectory->t[0], trajectory->y, p, k);
    for (ptrdiff_t n = 0; n < count; n++, out += MECHC_NX) {
        const ptrdiff_t step = mechc_step_of(trajectory, t[n]);
        const double start = trajectory->t[step];
        const double s = trajectory->count > 1
                       ? (t[n] - start) / (trajectory->t[step + 1] - start) : 0.0;
        const int rows = trajectory->count > 1 ? trajectory->dense_rows : 0;
        mechc_rk_polynomial(trajectory->y + step * MECHC_NX,
                            trajectory->dense + step * MECHC_NX * trajectory->dense_rows, rows, s,
                            out);
        if (s != 0.0 && mechc_project_between(t[n], out, p, k) != MECHC_RUNNING)
            for (int i = 0; i < MECHC_NX; i++) out[i] = NAN;
    }
}
