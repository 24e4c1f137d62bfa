/* Projection of one state to the nearest one on the constraints. */
#pragma once

#include "dynamics/scalar_stage.h"

/* A farther move of q to fit its speeds is none within its rounding. */
#define MECHC_MOST_FIT 1e-3

#if MECHC_NC_MAX > 0
/* Factor the rows at q without the weakest ones; returns how many were left out. */
MECHC_ONCE int mechc_strong_rows(double t, const double *q, const mechc_scalar_given *given,
                                 mechc_scalar_place *place, mechc_scalar_factors *rows)
{
    int weak = 0;
    const int rank = (int)given->k[MECHC_ROWS_THAT_COUNT];
    mechc_scalar_locate_all(t, q, given, place);
    mechc_scalar_factor_rows(place->jacobian, place->mass, place->length, MECHC_NC,
                             given->k[MECHC_ROWS_THAT_COUNT], rows);
    const double longest = mechc_max(rows->norm[0], place->ordinary_length);
    for (int i = 0; i < rank; i++)
        if (rows->norm[i] < MECHC_WEAK * longest) rows->inverse_norm[i] = 0.0, weak++;
    return weak;
}

/* Correct the speeds by the least change that satisfies every row but those left out. */
MECHC_STATIC void mechc_steady_rows(const mechc_scalar_place *place,
                                    const mechc_scalar_factors *rows, double *u)
{
    double values[MECHC_NC_MAX], step[MECHC_NU_MAX];
    mechc_scalar_velocity_residual(place, u, values);
    for (int i = 0; i < MECHC_NC; i++) values[i] = -values[i];
    mechc_scalar_least_change(rows, MECHC_NC, values, step);
    for (int i = 0; i < MECHC_NU; i++) u[i] += step[i];
}
#endif

#if MECHC_NH_MAX > 0
/* Close the loops; left: the remaining gap, in units of rounding. */
MECHC_STATIC int mechc_close_between(double t, double *q, const mechc_scalar_given *given,
                                     mechc_scalar_place *place, mechc_scalar_factors *rows)
{
    double before = HUGE_VAL, rounding, gap, values[MECHC_NC_MAX], step[MECHC_NU_MAX];
    for (int iteration = 0;; iteration++) {
        const int weak = mechc_strong_rows(t, q, given, place, rows);
        gap = mechc_scalar_gap(place, q, &rounding);
        if (!(gap < HUGE_VAL)) return MECHC_NOT_FINITE;
        const int settled = (weak || gap <= MECHC_CLOSES * rounding) && gap >= 0.25 * before;
        if (gap <= rounding || settled || iteration == 20)
            return gap <= MECHC_CLOSES * rounding || weak ? MECHC_RUNNING : MECHC_NOT_CLOSED;
        before = gap;
        mechc_scalar_gap_values(place, values);
        mechc_scalar_least_change(rows, MECHC_NC, values, step);
        mechc_scalar_displace(t, q, given, step);
    }
}

/* The rate of the weakest row at these speeds, and the direction in which q changes it most. */
MECHC_STATIC double mechc_weakest_rate(const mechc_scalar_place *place,
                                       const mechc_scalar_factors *rows, const double *u,
                                       double *direction)
{
    const int last = (int)rows->rank - 1;
    double values[MECHC_NC_MAX], each[MECHC_NC_MAX];
    mechc_scalar_velocity_residual(place, u, values);
    mechc_scalar_values_of_rows(rows, MECHC_NC, values, each);
    for (int j = 0; j < MECHC_NU; j++)
        direction[j] = rows->rows[last * MECHC_NU + j] / sqrt(rows->norm[last]);
    mechc_scalar_to_speeds(rows, direction);
    return each[last];
}

/* Beside a crossing the closure's rounding leaves q undecided along the weakest row, and that row
 * turns with it: move q there, by no more than closes as well, so that the speeds fit. */
MECHC_RARE void mechc_fit_to_speeds(double t, double *y, const mechc_scalar_given *given,
                                    mechc_scalar_place *place, mechc_scalar_factors *rows)
{
    const int last = (int)rows->rank - 1;
    double direction[MECHC_NU_MAX], turned[MECHC_NU_MAX], by[MECHC_NU_MAX], moved[MECHC_NQ_MAX], rounding;
    mechc_scalar_place near;
    mechc_scalar_factors there;
    rows->inverse_norm[last] = 0.0;
    mechc_steady_rows(place, rows, y + MECHC_NQ);
    const double rate = mechc_weakest_rate(place, rows, y + MECHC_NQ, direction);
    double fastest = 0.0;
    for (int j = 0; j < MECHC_NU; j++)
        fastest = mechc_max(fastest, fabs(direction[j]) / mechc_given_unit(given, MECHC_NQ + j));
    const double small = MECHC_SMALL_MOVE / fastest;
    for (int j = 0; j < MECHC_NU; j++) by[j] = small * direction[j];
    memcpy(moved, y, MECHC_NQ * sizeof *y);
    mechc_scalar_displace(t, moved, given, by);
    mechc_strong_rows(t, moved, given, &near, &there);
    const double slope = (mechc_weakest_rate(&near, &there, y + MECHC_NQ, turned) - rate) / small;
    mechc_scalar_gap(place, y, &rounding);
    const double most = rounding / sqrt(rows->norm[last]);
    double step = slope != 0.0 ? -rate / slope : 0.0;
    step = mechc_max(-most, mechc_min(most, step));
    if (!(fabs(step) * fastest < MECHC_MOST_FIT)) return;
    for (int j = 0; j < MECHC_NU; j++) by[j] = step * direction[j];
    mechc_scalar_displace(t, y, given, by);
    mechc_strong_rows(t, y, given, place, rows);
}

/* Correct the speeds at a closed configuration by every row but the weakest. */
MECHC_RARE void mechc_keep_weakest_rate(double t, double *y, const mechc_scalar_given *given)
{
    mechc_scalar_place place;
    mechc_scalar_factors rows;
    mechc_strong_rows(t, y, given, &place, &rows);
    rows.inverse_norm[(int)rows.rank - 1] = 0.0;
    mechc_steady_rows(&place, &rows, y + MECHC_NQ);
}
#endif

/* Project a state between accepted ones. */
MECHC_ONCE int mechc_project_between(double t, double *y, const mechc_scalar_given *given)
{
#if MECHC_NC_MAX > 0
    mechc_scalar_place place;
    mechc_scalar_factors rows;
#if MECHC_NH_MAX > 0
    const int last = (int)given->k[MECHC_ROWS_THAT_COUNT] - 1;
    const int status = mechc_close_between(t, y, given, &place, &rows);
    if (status != MECHC_RUNNING) return status;
    const double longest = mechc_max(rows.norm[0], place.ordinary_length);
    if (rows.norm[last] < MECHC_DELICATE * longest && rows.norm[last] > MECHC_SURELY * longest)
        mechc_fit_to_speeds(t, y, given, &place, &rows);
#else
    mechc_strong_rows(t, y, given, &place, &rows);
#endif
    mechc_steady_rows(&place, &rows, y + MECHC_NQ);
#else
    (void)t, (void)y, (void)given;
#endif
    return MECHC_RUNNING;
}

/* Whether a state with closed loops has to be projected like those between accepted ones. */
MECHC_STATIC int mechc_is_delicate(const mechc_scalar_place *place, const mechc_scalar_given *given)
{
#if MECHC_NH_MAX > 0 && MECHC_NC_MAX == MECHC_NH_MAX
    return MECHC_NC == MECHC_NH && (int)given->k[MECHC_ROWS_THAT_COUNT] == MECHC_NH
        && mechc_scalar_conditioning(place) < MECHC_TOO_NEAR;
#else
    (void)place, (void)given;
    return 0;
#endif
}

/* Project a state; moved[0], moved[1]: largest closure gap and largest velocity residual before. */
MECHC_ONCE int mechc_project_state(double t, double *y, const mechc_scalar_given *given,
                                   double *moved)
{
    mechc_scalar_place place;
    long iterations = 0;
    double kept[MECHC_NX_MAX];
    memcpy(kept, y, MECHC_NX * sizeof *y);
    moved[0] = moved[1] = 0.0;
#if MECHC_NH_MAX > 0
    double rounding;
    mechc_locate(t, y, given, &place);
    moved[0] = mechc_scalar_gap(&place, y, &rounding);
#endif
    const int status = mechc_close_loops(t, y, given, &place, &iterations);
#if MECHC_NC_MAX > 0
    double residual[MECHC_NC_MAX];
    if (status == MECHC_RUNNING) {
        mechc_scalar_velocity_residual(&place, y + MECHC_NQ, residual);
        for (int i = 0; i < MECHC_NC; i++) moved[1] = mechc_max(moved[1], fabs(residual[i]));
        mechc_scalar_steady(&place, y + MECHC_NQ);
    }
#endif
    if (!mechc_is_delicate(&place, given)) return status;
    memcpy(y, kept, MECHC_NX * sizeof *y);
#if MECHC_NH_MAX > 0
    if (moved[0] <= rounding) { /* no other q is closed better */
        mechc_keep_weakest_rate(t, y, given);
        return MECHC_RUNNING;
    }
#endif
    return mechc_project_between(t, y, given);
}

/* Remove from an error what the projection of the step's end will remove. */
MECHC_STATIC void mechc_project_error(const mechc_scalar_place *place, double *error)
{
#if MECHC_NH_MAX > 0
    for (int part = MECHC_IDENTITY_KINEMATICS ? 0 : MECHC_NQ; part < MECHC_NX; part += MECHC_NQ) {
        double values[MECHC_NC_MAX], step[MECHC_NU_MAX];
        mechc_scalar_rates_of_rows(place, error + part, values);
        for (int i = 0; i < MECHC_NC; i++) values[i] = -values[i];
        mechc_scalar_least_step_at(place, values, step);
        for (int i = 0; i < MECHC_NU; i++) error[part + i] += step[i];
    }
#else
    (void)place, (void)error;
#endif
}
