/* One step of every lane: its stages, its end on the constraints, its error and what follows from
 * it.  See abreast.h for the method. */

#define MECHC_ABREAST_ENDS 1 /* evaluations at a step's end */
#define MECHC_ABREAST_CLOSINGS 4
#define MECHC_ABREAST_SAFETY 0.84
#define MECHC_ABREAST_GROWTH 2.0

MECHC_INLINE mechc_lane mechc_abreast_rates_at(const struct mechc_abreast *a, mechc_lane t,
                                               const mechc_lane *state, int regular,
                                               mechc_lane *rates)
{
    mechc_lanes_place place;
    mechc_lanes_locate_near(t, state, a->p, a->k, &place, 0, 0, regular);
    mechc_lanes_coordinate_rates_of(t, state, state + MECHC_NQ, a->p, a->k, rates);
    mechc_lanes_accelerate(t, state, state + MECHC_NQ, a->p, a->k, &place, rates + MECHC_NQ, 0);
#if MECHC_NH > 0
    if (!regular) return mechc_lanes_conditioning_at(&place);
#endif
    return mechc_spread(1.0);
}

MECHC_ONCE void mechc_abreast_rates(const struct mechc_abreast *a, mechc_lane t,
                                    const mechc_lane *state, mechc_lane *rates)
{
    mechc_abreast_rates_at(a, t, state, 1, rates);
}

/* Likewise, and how well conditioned the rows are there. */
MECHC_ONCE void mechc_abreast_watched_rates(struct mechc_abreast *a, mechc_lane t,
                                            const mechc_lane *state, mechc_lane *rates)
{
    a->met = mechc_lesser(mechc_abreast_rates_at(a, t, state, 0, rates), a->met);
}

/* sum_j row[j] rate_j */
MECHC_INLINE void mechc_abreast_sum(const struct mechc_abreast *a, const double *row, int rates,
                                    mechc_lane *sum)
{
    for (int i = 0; i < MECHC_NX; i++) sum[i] = row[0] * a->rates[0][i];
    for (int j = 1; j < rates; j++)
        if (row[j] != 0.0)
            for (int i = 0; i < MECHC_NX; i++) sum[i] += row[j] * a->rates[j][i];
}

/* The stages whose conditioning is looked at: with both ends, none lies far from one of them. */
MECHC_INLINE int mechc_abreast_watches(int stage) { return stage == 5 || stage == 8; }

MECHC_INLINE void mechc_abreast_stage(struct mechc_abreast *a, int stage)
{
    mechc_lane state[MECHC_NX], sum[MECHC_NX];
    const mechc_lane t = a->t + mechc_dop853.nodes[stage] * a->h;
    mechc_abreast_sum(a, mechc_dop853.matrix + stage * MECHC_MOST_RATES, stage, sum);
    for (int i = 0; i < MECHC_NX; i++) state[i] = a->y[i] + a->h * sum[i];
    if (MECHC_NH > 0 && mechc_abreast_watches(stage))
        mechc_abreast_watched_rates(a, t, state, a->rates[stage]);
    else
        mechc_abreast_rates(a, t, state, a->rates[stage]);
    if (stage == mechc_dop853.stages - 1) memcpy(a->last_stage, state, sizeof state);
}

/* The end, with what rounding has left of the steps before.  Kahan (1965). */
MECHC_INLINE void mechc_abreast_reach(struct mechc_abreast *a)
{
    mechc_lane sum[MECHC_NX];
    const int stages = mechc_dop853.stages;
    mechc_abreast_sum(a, mechc_dop853.matrix + stages * MECHC_MOST_RATES, stages, sum);
    for (int i = 0; i < MECHC_NX; i++) {
        const mechc_lane gain = a->h * sum[i] + a->left_over[i];
        a->end[i] = a->y[i] + gain;
        a->next_left_over[i] = gain - (a->end[i] - a->y[i]);
    }
}

/* Close the loops of the ends; a lane that is closed is not moved on. */
MECHC_INLINE void mechc_abreast_close(struct mechc_abreast *a, mechc_lane t,
                                      mechc_lanes_place *place)
{
#if MECHC_NH > 0
    for (int closing = 0;; closing++) {
        mechc_lane q[MECHC_NQ], rounding;
        mechc_lanes_locate(t, a->end, a->p, a->k, place);
        const mechc_lane gap = mechc_lanes_gap_and_rounding(place, a->end, &rounding);
        const mechc_lane_mask open = ~(gap <= 2.0 * rounding);
        a->closed = gap <= 16.0 * rounding;
        a->configurations += 1 & (open | -(int64_t)(closing == 0));
        if (!mechc_any(open) || closing == MECHC_ABREAST_CLOSINGS) return;
        memcpy(q, a->end, sizeof q);
        mechc_lanes_correct(t, q, a->p, a->k, place);
        for (int i = 0; i < MECHC_NQ; i++) a->end[i] = mechc_choose(open, q[i], a->end[i]);
    }
#else
    mechc_lanes_locate(t, a->end, a->p, a->k, place);
    a->closed = ~(mechc_lane_mask){0};
    a->configurations += 1;
#endif
}

/* The ends on the constraints, and their rates. */
MECHC_ONCE void mechc_abreast_project(struct mechc_abreast *a)
{
    mechc_lanes_place place;
    mechc_lane *rates = a->rates[mechc_dop853.stages], *u = a->end + MECHC_NQ;
    const mechc_lane t = a->t + a->h;
    mechc_abreast_close(a, t, &place);
    mechc_lanes_steady(&place, u);
    mechc_lanes_coordinate_rates_of(t, a->end, u, a->p, a->k, rates);
    mechc_lanes_accelerate(t, a->end, u, a->p, a->k, &place, rates + MECHC_NQ, 0);
#if MECHC_NH > 0
    a->conditioning = mechc_lanes_conditioning(&place);
    a->met = mechc_lesser(a->conditioning * a->conditioning, a->met);
#else
    a->conditioning = mechc_spread(1.0);
#endif
}

/* The step to attempt, and whether it is the last. */
MECHC_INLINE void mechc_abreast_next_step(struct mechc_abreast *a)
{
    const mechc_lane left = a->t1 - a->t, size = mechc_size_of(left);
    const mechc_lane step = mechc_lesser(a->step, a->max_step);
    const mechc_lane ahead = mechc_choose(left < 0.0, -step, step);
    a->last = size <= 1.01 * step;
    a->h = mechc_choose(size < 2.0 * step, 0.5 * left, ahead);
    a->h = mechc_choose(a->last, left, a->h);
}

MECHC_ONCE void mechc_abreast_step(struct mechc_abreast *a)
{
    mechc_abreast_next_step(a);
    a->met = mechc_spread(HUGE_VAL);
    for (int stage = 1; stage < mechc_dop853.stages; stage++) mechc_abreast_stage(a, stage);
    mechc_abreast_reach(a);
    mechc_abreast_project(a);
}

/* Square of the step's error over what is tolerated: see mechc_rk_error. */
MECHC_INLINE mechc_lane mechc_abreast_error(const struct mechc_abreast *a)
{
    mechc_lane first[MECHC_NX], second[MECHC_NX];
    mechc_lane squares = mechc_spread(0.0), second_squares = mechc_spread(0.0);
    mechc_abreast_sum(a, mechc_dop853.error, mechc_dop853.stages, first);
    mechc_abreast_sum(a, mechc_dop853.second_error, mechc_dop853.stages, second);
    for (int i = 0; i < MECHC_NX; i++) {
        const mechc_lane y = mechc_size_of(a->y[i]), end = mechc_size_of(a->end[i]);
        const mechc_lane size = mechc_choose(y > end, y, end);
        const mechc_lane asked = a->of_scale * a->scale[i] + (a->floor[i] + a->of_size * size);
        const mechc_lane digit = 2.220446049250313e-16 * size;
        const mechc_lane tolerated = mechc_choose(asked > digit, asked, digit);
        const mechc_lane weight = a->h * mechc_rough_inverse(tolerated);
        squares += (first[i] * weight) * (first[i] * weight);
        second_squares += (second[i] * weight) * (second[i] * weight);
    }
    const mechc_lane both = squares + 0.01 * second_squares;
    return mechc_choose(squares > 0.0, squares * squares / (both * MECHC_NX), squares);
}

/* What the error lets the step grow by; it is expected to go on growing as it did.
 * Gustafsson (1991). */
MECHC_INLINE mechc_lane mechc_abreast_factor(struct mechc_abreast *a)
{
    const mechc_lane plain = MECHC_ABREAST_SAFETY * mechc_rough_root(a->error);
    const mechc_lane trend =
        mechc_size_of(a->h) * plain * mechc_rough_inverse(a->last_step * a->last_factor);
    const mechc_lane_mask known = (a->last_factor > 0.0) & (a->error <= 1.0);
    const mechc_lane factor = mechc_choose(known & (trend < 1.0), plain * trend, plain);
    const mechc_lane most =
        mechc_choose(a->refused, mechc_spread(1.0), mechc_spread(MECHC_ABREAST_GROWTH));
    a->factor = plain;
    return mechc_lesser(mechc_choose(factor > 0.2, factor, mechc_spread(0.2)), most);
}

/* The lanes whose step stands, and those that are to go on alone: what is beyond the lanes, or
 * wrong, is for the path of one run to tell. */
MECHC_INLINE mechc_lane_mask mechc_abreast_judge(struct mechc_abreast *a, mechc_lane_mask *leaves)
{
    const mechc_lane *rates = a->rates[mechc_dop853.stages];
    mechc_lane sum = mechc_size_of(rates[0]);
    for (int i = 1; i < MECHC_NX; i++) sum += mechc_size_of(rates[i]);
    const mechc_lane t = mechc_size_of(a->t), left = mechc_size_of(a->t1 - a->t);
    const mechc_lane smallest = (16.0 * 2.220446049250313e-16) * mechc_choose(t > left, t, left);
    a->error = mechc_abreast_error(a);
    const mechc_lane_mask good = a->error <= 1.0, finite = a->error < HUGE_VAL;
    const mechc_lane_mask small = ~a->last & (mechc_size_of(a->h) < smallest);
    const mechc_lane_mask regular = a->closed & (sum < HUGE_VAL)
                                  & (a->met >= MECHC_ABREAST_LOW * MECHC_ABREAST_LOW);
    *leaves = ~finite | small | (good & ~regular);
    return good & ~*leaves;
}

/* Extra stages and rows of the dense output: see mechc_rk_dense. */
MECHC_ONCE void mechc_abreast_dense(struct mechc_abreast *a, mechc_lane *rows)
{
    const mechc_tableau *tableau = &mechc_dop853;
    mechc_lane state[MECHC_NX], sum[MECHC_NX];
    for (int stage = tableau->stages + 1; stage < tableau->rates; stage++) {
        mechc_abreast_sum(a, tableau->matrix + stage * MECHC_MOST_RATES, stage, sum);
        for (int i = 0; i < MECHC_NX; i++) state[i] = a->y[i] + a->h * sum[i];
        mechc_abreast_rates(a, a->t + tableau->nodes[stage] * a->h, state, a->rates[stage]);
    }
    for (int i = 0; i < MECHC_NX; i++) {
        const mechc_lane r0 = a->end[i] - a->y[i], r1 = a->h * a->rates[0][i] - r0;
        rows[i] = r0;
        rows[MECHC_NX + i] = r1;
        rows[2 * MECHC_NX + i] = r0 - a->h * a->rates[tableau->stages][i] - r1;
    }
    for (int row = 3; row < tableau->dense_rows; row++) {
        mechc_abreast_sum(a, tableau->dense + (row - 3) * MECHC_MOST_RATES, tableau->rates, sum);
        for (int i = 0; i < MECHC_NX; i++) rows[row * MECHC_NX + i] = a->h * sum[i];
    }
}

/* Count steps that stability limits: see mechc_rk_unstable_beyond. */
MECHC_INLINE void mechc_abreast_watch_stiffness(struct mechc_abreast *a, mechc_lane_mask accepted)
{
    const int stages = mechc_dop853.stages;
    mechc_lane rate = mechc_spread(0.0), state = rate;
    for (int i = 0; i < MECHC_NX; i++) {
        const mechc_lane weight = mechc_rough_inverse(a->scale[i]);
        const mechc_lane change = weight * (a->rates[stages][i] - a->rates[stages - 1][i]);
        const mechc_lane apart = weight * (a->end[i] - a->last_stage[i]);
        rate += change * change;
        state += apart * apart;
    }
    const double square = mechc_dop853.stability * mechc_dop853.stability;
    const mechc_lane_mask limited =
        accepted & (state > 0.0) & (a->h * a->h * rate > square * state);
    const mechc_lane_mask easy = accepted & ~limited;
    a->stiff -= limited;
    a->easy = (a->easy - easy) & ~limited;
    a->stiff &= a->easy < 6;
}

/* Take over the steps that stand; those refused are tried again, shorter. */
MECHC_ONCE void mechc_abreast_accept(struct mechc_abreast *a, mechc_lane_mask accepted,
                                     mechc_lane_mask leaves)
{
    const mechc_lane size = mechc_size_of(a->h), next = a->h + a->time_left_over;
    const mechc_lane t = mechc_choose(a->last, a->t1, a->t + next);
    const mechc_lane *rates = a->rates[mechc_dop853.stages];
    const mechc_lane_mask worse = accepted & (a->conditioning < a->least);
    mechc_abreast_watch_stiffness(a, accepted);
    a->step = mechc_choose(leaves, a->step, size * mechc_abreast_factor(a));
    a->refused = (a->refused & leaves) | ~(accepted | leaves);
    a->steps -= accepted;
    a->rejected += 1 + accepted;
    a->time_left_over = mechc_choose(accepted, next - (t - a->t), a->time_left_over);
    a->t = mechc_choose(accepted, t, a->t);
    for (int i = 0; i < MECHC_NX; i++) {
        a->y[i] = mechc_choose(accepted, a->end[i], a->y[i]);
        a->left_over[i] = mechc_choose(accepted, a->next_left_over[i], a->left_over[i]);
        a->rates[0][i] = mechc_choose(accepted, rates[i], a->rates[0][i]);
        const mechc_lane reached = mechc_size_of(a->y[i]);
        if (i >= MECHC_NQ) a->scale[i] = mechc_choose(reached > a->scale[i], reached, a->scale[i]);
    }
    a->least = mechc_choose(worse, a->conditioning, a->least);
    a->least_time = mechc_choose(worse, a->t, a->least_time);
    a->first = mechc_choose(accepted, a->conditioning, a->first);
    a->last_step = mechc_choose(accepted, size, a->last_step);
    a->last_factor = mechc_choose(accepted, a->factor, a->last_factor);
}
