/* The stages of a collocation step, side by side in the lanes: their values from the unknowns, what
 * closes their loops, their rates, and one fixed-point iteration.  See gauss.h for the method.
 */

#define MECHC_BLOCKS (MECHC_STAGES / MECHC_LANES)
#define MECHC_UNKNOWNS (MECHC_IDENTITY_KINEMATICS ? MECHC_NU : MECHC_NX)
#define MECHC_FIRST_UNKNOWN (MECHC_NX - MECHC_UNKNOWNS) /* the component it is the rate of */

/* How stages are kept on the constraints: not at all, or closed after or before their rates. */
enum { MECHC_PLAIN, MECHC_CLOSE_AFTER, MECHC_CLOSE_BEFORE };

/* Integral and second integral to the step's end, Legendre coefficients of degrees 7 and 6. */
typedef double mechc_sums __attribute__((vector_size(32)));
enum { MECHC_FIRST, MECHC_SECOND, MECHC_TOP, MECHC_NEXT };

struct mechc_gauss {
    mechc_lane p[MECHC_AT_LEAST_ONE(MECHC_PASSED)], k[MECHC_CONSTANTS];
    mechc_lane q[MECHC_NQ][MECHC_BLOCKS];    /* stages as last evaluated */
    mechc_lane turns[MECHC_BLOCKS][MECHC_AT_LEAST_ONE(3 * MECHC_TURNS)]; /* see sine_cosine.h */
    mechc_lane shift[MECHC_NQ][MECHC_BLOCKS]; /* what closes their loops */
    mechc_sums columns[MECHC_STAGES];
    double rates[MECHC_UNKNOWNS][MECHC_STAGES];
    double ends[MECHC_UNKNOWNS]; /* rates at the last accepted end */
    double least[MECHC_STAGES]; /* conditioning, squared */
    double weights[MECHC_NX];            /* 1 over what is tolerated */
    double tolerated;                    /* the largest, over the component's scale */
    double error_weights[MECHC_UNKNOWNS]; /* of the polynomial's last coefficients, squared */
    double error;
    double low[MECHC_NX];        /* of the state, what run->y is too coarse for */
    double next_low[MECHC_NX];
    double lowest;               /* of `least` */
    double left;                 /* gaps that are left, in units of rounding */
    int closing;                 /* how stages are kept on the constraints */
    double shrinking;            /* from the iteration's second change to its third; 0: no third */
    double last_step;            /* 0: no polynomial yet */
    double factor, last_factor;  /* by which this step's error, and the last one's, would have let
                                    it grow; 0: none yet */
    double tried[MECHC_UNKNOWNS][MECHC_STAGES]; /* rates of the last accepted step */
};

MECHC_INLINE mechc_lane mechc_spread(double x) { return (mechc_lane){0} + x; }

MECHC_INLINE mechc_lane mechc_take(const double *eight, int block)
{
    mechc_lane lanes;
    memcpy(&lanes, eight + block * MECHC_LANES, sizeof lanes);
    return lanes;
}

MECHC_INLINE void mechc_put(mechc_lane lanes, double *eight, int block)
{
    memcpy(eight + block * MECHC_LANES, &lanes, sizeof lanes);
}

/* Stage values of one block before any projection. */
MECHC_INLINE void mechc_gauss_states(const struct mechc_gauss *g, const double *y, double h,
                                     int block, mechc_lane *state)
{
    mechc_lane first[MECHC_UNKNOWNS];
    for (int i = 0; i < MECHC_UNKNOWNS; i++)
        first[i] = mechc_take(mechc_gauss_first, block) * g->rates[i][0];
    for (int j = 1; j < MECHC_STAGES; j++) {
        const mechc_lane column = mechc_take(mechc_gauss_first + j * MECHC_STAGES, block);
        for (int i = 0; i < MECHC_UNKNOWNS; i++) first[i] += column * g->rates[i][j];
    }
    for (int i = 0; i < MECHC_UNKNOWNS; i++)
        state[MECHC_FIRST_UNKNOWN + i] = y[MECHC_FIRST_UNKNOWN + i] + h * first[i];
#if MECHC_IDENTITY_KINEMATICS
    mechc_lane second[MECHC_NQ];
    const mechc_lane nodes = h * mechc_take(mechc_gauss_nodes, block);
    for (int i = 0; i < MECHC_NQ; i++)
        second[i] = mechc_take(mechc_gauss_second, block) * g->rates[i][0];
    for (int j = 1; j < MECHC_STAGES; j++) {
        const mechc_lane column = mechc_take(mechc_gauss_second + j * MECHC_STAGES, block);
        for (int i = 0; i < MECHC_NQ; i++) second[i] += column * g->rates[i][j];
    }
    for (int i = 0; i < MECHC_NQ; i++)
        state[i] = y[i] + (y[MECHC_NQ + i] * nodes + h * h * second[i]);
#endif
}

#if MECHC_NH > 0
/* One correction of the stages towards closed loops; moved: by how much. */
MECHC_INLINE void mechc_gauss_close(struct mechc_gauss *g, mechc_lane time, int block,
                                    const mechc_lanes_place *place, mechc_lane *q,
                                    mechc_lane *moved)
{
    for (int i = 0; i < MECHC_NQ; i++) moved[i] = q[i];
    mechc_lanes_correct_beyond(time, q, g->p, g->k, place, g->left);
    for (int i = 0; i < MECHC_NQ; i++) {
        moved[i] = q[i] - moved[i];
        g->shift[i][block] += moved[i];
    }
}
#endif

/* Accelerations, and rates of coordinates where these are unknowns. */
MECHC_INLINE void mechc_gauss_rates(const struct mechc_gauss *g, mechc_lane time,
                                    const mechc_lane *state, const mechc_lanes_place *place,
                                    mechc_lane *rates)
{
    mechc_lanes_accelerate(time, state, state + MECHC_NQ, g->p, g->k, place,
                           rates + MECHC_UNKNOWNS - MECHC_NU, 0);
#if !MECHC_IDENTITY_KINEMATICS
    mechc_lanes_coordinate_rates_of(time, state, state + MECHC_NQ, g->p, g->k, rates);
#endif
}

/* Rates of one block of stages as they stand; first: before their sines and their conditioning are
 * known. */
MECHC_INLINE void mechc_gauss_unclosed(struct mechc_gauss *g, double t, const double *y, double h,
                                       int block, int first, mechc_lane *rates)
{
    mechc_lanes_place place;
    mechc_lane state[MECHC_NX];
    const mechc_lane time = t + h * mechc_take(mechc_gauss_nodes, block);
    mechc_gauss_states(g, y, h, block, state);
    mechc_lanes_locate_near(time, state, g->p, g->k, &place, g->turns[block], !first, !first);
    mechc_gauss_rates(g, time, state, &place, rates);
#if MECHC_NH > 0
    if (!first) return;
    for (int i = 0; i < MECHC_NQ; i++) g->q[i][block] = state[i];
    mechc_put(mechc_lanes_conditioning_at(&place), g->least, block);
#endif
}

MECHC_ONCE void mechc_gauss_first_stages(struct mechc_gauss *g, double t, const double *y, double h,
                                         int block, mechc_lane *rates)
{
    mechc_gauss_unclosed(g, t, y, h, block, 1, rates);
}

MECHC_ONCE void mechc_gauss_plain_stages(struct mechc_gauss *g, double t, const double *y, double h,
                                         int block, mechc_lane *rates)
{
    mechc_gauss_unclosed(g, t, y, h, block, 0, rates);
}

/* Rates of one block of stages at positions and speeds projected; places shift and q. */
MECHC_ONCE void mechc_gauss_stages(struct mechc_gauss *g, double t, const double *y, double h,
                                   int block, mechc_lane *rates, mechc_lane *moved)
{
    mechc_lanes_place place;
    mechc_lane state[MECHC_NX];
    const mechc_lane time = t + h * mechc_take(mechc_gauss_nodes, block);
    mechc_gauss_states(g, y, h, block, state);
    for (int i = 0; i < MECHC_NQ; i++) state[i] += g->shift[i][block];
    mechc_lanes_locate_near(time, state, g->p, g->k, &place, g->turns[block], 0, 0);
#if MECHC_NH > 0
    if (g->closing == MECHC_CLOSE_BEFORE) {
        mechc_gauss_close(g, time, block, &place, state, moved);
        mechc_lanes_locate(time, state, g->p, g->k, &place);
    }
#endif
    for (int i = 0; i < MECHC_NQ; i++) g->q[i][block] = state[i];
    mechc_lanes_steady(&place, state + MECHC_NQ);
    mechc_gauss_rates(g, time, state, &place, rates);
#if MECHC_NH > 0
    mechc_gauss_close(g, time, block, &place, state, moved);
    mechc_put(mechc_lanes_conditioning_at(&place), g->least, block);
#else
    for (int i = 0; i < MECHC_NQ; i++) moved[i] = mechc_spread(0.0);
#endif
}

/* The greater of a and |b|. */
MECHC_INLINE mechc_lane mechc_larger(mechc_lane a, mechc_lane b)
{
    return mechc_greater(a, (mechc_lane)((mechc_lane_mask)b & INT64_MAX));
}

/* One iteration; the largest change of a rate over what is tolerated. */
MECHC_ONCE double mechc_gauss_iterate(struct mechc_gauss *g, double t, const double *y, double h,
                                      int first)
{
    const double *weights = g->weights;
    mechc_lane rates[MECHC_BLOCKS][MECHC_UNKNOWNS], moved[MECHC_NQ], change = {0};
    for (int block = 0; block < MECHC_BLOCKS; block++) {
        if (g->closing == MECHC_PLAIN) {
            (first ? mechc_gauss_first_stages : mechc_gauss_plain_stages)(g, t, y, h, block,
                                                                          rates[block]);
            continue;
        }
        mechc_gauss_stages(g, t, y, h, block, rates[block], moved);
        for (int i = 0; i < MECHC_NQ; i++) change = mechc_larger(change, moved[i] * weights[i]);
    }
    for (int i = 0; i < MECHC_UNKNOWNS; i++)
        for (int block = 0; block < MECHC_BLOCKS; block++) {
            const mechc_lane by = rates[block][i] - mechc_take(g->rates[i], block);
            const double weight = fabs(h) * weights[MECHC_FIRST_UNKNOWN + i];
            change = mechc_larger(change, by * weight);
            mechc_put(rates[block][i], g->rates[i], block);
        }
    return mechc_greatest(change);
}
