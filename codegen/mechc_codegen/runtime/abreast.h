/* Several runs of the explicit pair of order 8 abreast, one in each lane, far from critical
 * configurations.
 *
 * Every lane has its own time, step, error and end; nothing passes from one lane to another, so the
 * numbers of a run do not depend on what runs beside it, and a run by itself is the case of one
 * lane in use.  Stages are taken as the equations stand and the step's end is projected: off the
 * constraints by d the equations are wrong by d over the conditioning, which counts with the
 * step's error.  A lane whose conditioning falls low takes its step back and goes on alone
 * (explicit_rk.h), with every stage on the constraints and crossings looked for.
 */

#define MECHC_ABREAST_LOW 0.2   /* conditioning below which a run goes on alone */
#define MECHC_ABREAST_BACK 0.25 /* and above which it comes back */

/* Larger states and their stages leave the first cache. */
#define MECHC_ABREAST (MECHC_NX <= 32 && MECHC_NC == MECHC_NH)

MECHC_STATIC int mechc_abreast_fits(const mechc_rk_run *run)
{
    const int alone = run->alone || run->dip.tries || run->dip.wanted != 0.0;
    if (!MECHC_ABREAST || alone || run->tableau != &mechc_dop853) return 0;
    if (mechc_tableaus[run->method] != &mechc_dop853) return 0;
    return MECHC_NH == 0 || (run->dip.rank == MECHC_NH && run->dip.first >= MECHC_ABREAST_LOW);
}

/* After an accepted step of a run by itself. */
MECHC_STATIC void mechc_abreast_come_back(mechc_rk_run *run)
{
    run->last_step = run->last_factor = 0.0;
    if (MECHC_NH == 0 || run->dip.first > MECHC_ABREAST_BACK) run->alone = 0;
}

#if MECHC_ABREAST
struct mechc_abreast {
    mechc_lane p[MECHC_AT_LEAST_ONE(MECHC_PASSED)], k[MECHC_CONSTANTS];
    mechc_lane t, t1, time_left_over, step, max_step, h;
    mechc_lane y[MECHC_NX], left_over[MECHC_NX], scale[MECHC_NX];
    mechc_lane end[MECHC_NX], next_left_over[MECHC_NX], last_stage[MECHC_NX];
    mechc_lane rates[MECHC_MOST_RATES][MECHC_NX];
    mechc_lane floor[MECHC_NX], of_scale, of_size; /* tolerated: a number, of the scale, of |y| */
    mechc_lane first, least, least_time; /* conditioning: at y; the least at a step's end, when */
    mechc_lane met, conditioning;        /* in this step, squared; at its end */
    mechc_lane error, factor;            /* of this step: its error squared; what it lets h grow by */
    mechc_lane last_step, last_factor;   /* of the last accepted step; 0: none */
    mechc_lane_mask refused, last, closed;
    mechc_lane_mask steps, rejected, configurations, stiff, easy;
};

MECHC_INLINE mechc_lane mechc_choose(mechc_lane_mask mask, mechc_lane a, mechc_lane b)
{
    return (mechc_lane)((mask & (mechc_lane_mask)a) | (~mask & (mechc_lane_mask)b));
}

MECHC_INLINE mechc_lane mechc_lesser(mechc_lane a, mechc_lane b)
{
    return mechc_choose(a < b, a, b);
}

MECHC_INLINE mechc_lane mechc_size_of(mechc_lane x)
{
    return (mechc_lane)((mechc_lane_mask)x & INT64_MAX);
}

/* 1/x within an eighth, for positive x: exponent and mantissa subtracted as one integer. */
MECHC_INLINE mechc_lane mechc_rough_inverse(mechc_lane x)
{
    return (mechc_lane)(INT64_C(0x7fde623822fc16e6) - (mechc_lane_mask)x);
}

/* x^(-1/16) within three per cent, for x >= 0, likewise: a sixteenth of it is subtracted. */
MECHC_INLINE mechc_lane mechc_rough_root(mechc_lane x)
{
    typedef uint64_t bits __attribute__((vector_size(8 * MECHC_LANES)));
    return (mechc_lane)(INT64_C(0x43ee500000000000) - (mechc_lane_mask)((bits)x >> 4));
}

#include "abreast_step.h"

/* Put a run into a lane. */
MECHC_STATIC void mechc_abreast_load(struct mechc_abreast *a, int lane, const mechc_rk_run *run)
{
    const double asked = mechc_rk_share(run) * run->rtol;
    for (int i = 0; i < MECHC_PASSED; i++) a->p[i][lane] = run->p[i];
    for (int i = 0; i < MECHC_CONSTANTS; i++) a->k[i][lane] = run->k[i];
    for (int i = 0; i < MECHC_NX; i++) {
        a->y[i][lane] = run->y[i];
        a->left_over[i][lane] = run->left_over[i];
        a->scale[i][lane] = run->scale[i];
        a->rates[0][i][lane] = run->rates[i];
        a->floor[i][lane] = run->has_tolerances ? mechc_rk_share(run) * run->tolerance[i] : 0.0;
    }
    a->of_scale[lane] = run->has_tolerances ? 0.0 : asked;
    a->of_size[lane] = run->has_tolerances ? asked : 0.0;
    a->t[lane] = run->head.t;
    a->t1[lane] = run->t1;
    a->time_left_over[lane] = run->time_left_over;
    a->step[lane] = run->step;
    a->max_step[lane] = run->max_step;
    a->first[lane] = run->dip.first;
    a->least[lane] = run->head.stats.least_singular;
    a->least_time[lane] = run->head.stats.least_singular_time;
    a->last_step[lane] = run->last_step;
    a->last_factor[lane] = run->last_factor;
    a->refused[lane] = -(int64_t)(run->refused != 0);
    a->steps[lane] = a->rejected[lane] = a->configurations[lane] = 0;
    a->stiff[lane] = run->stiff;
    a->easy[lane] = run->easy;
}

/* Take it out again. */
MECHC_STATIC void mechc_abreast_store(const struct mechc_abreast *a, int lane, mechc_rk_run *run)
{
    mechc_stats *stats = &run->head.stats;
    for (int i = 0; i < MECHC_NX; i++) {
        run->y[i] = a->y[i][lane];
        run->left_over[i] = a->left_over[i][lane];
        run->scale[i] = a->scale[i][lane];
        run->rates[i] = a->rates[0][i][lane];
    }
    run->head.t = a->t[lane];
    run->time_left_over = a->time_left_over[lane];
    run->step = a->step[lane];
    run->conditioning = run->dip.first = a->first[lane];
    run->last_step = a->last_step[lane];
    run->last_factor = a->last_factor[lane];
    run->refused = a->refused[lane] != 0;
    run->stiff = (int)a->stiff[lane];
    run->easy = (int)a->easy[lane];
    stats->least_singular = a->least[lane];
    stats->least_singular_time = a->least_time[lane];
    stats->steps += a->steps[lane];
    stats->rejected += a->rejected[lane];
    stats->closure_iterations += a->configurations[lane];
    stats->rhs_evaluations +=
        (a->steps[lane] + a->rejected[lane]) * (mechc_dop853.stages + MECHC_ABREAST_ENDS);
}

/* Keep the steps that were accepted. */
MECHC_STATIC int mechc_abreast_keep(const struct mechc_abreast *a, mechc_rk_run **runs, int lane,
                                    const mechc_lane *rows)
{
    mechc_trajectory *trajectory = &runs[lane]->head.trajectory;
    double y[MECHC_NX];
    if (!mechc_make_room(trajectory)) return 0;
    const ptrdiff_t size = trajectory->width * trajectory->dense_rows;
    double *dense = trajectory->dense + (trajectory->count - 1) * size;
    for (ptrdiff_t i = 0; i < size; i++)
        dense[i] = i < mechc_dop853.dense_rows * MECHC_NX ? rows[i][lane] : 0.0;
    for (int i = 0; i < MECHC_NX; i++) y[i] = a->y[i][lane];
    return mechc_append(trajectory, a->t[lane], y);
}

/* What each run does next, once a step of all of them is judged; 1 where one is to leave. */
MECHC_STATIC int mechc_abreast_part(struct mechc_abreast *a, mechc_rk_run **runs, int count,
                                    mechc_lane_mask accepted, mechc_lane_mask leaves,
                                    const mechc_lane *rows)
{
    int any = 0;
    for (int lane = 0; lane < count; lane++) {
        mechc_rk_run *run = runs[lane];
        if (leaves[lane]) run->alone = any = 1;
        if (!accepted[lane]) continue;
        if (!mechc_abreast_keep(a, runs, lane, rows)) run->head.status = MECHC_NO_MEMORY;
        else if (a->last[lane]) run->head.status = MECHC_FINISHED;
        if (run->may_stiffen && a->stiff[lane] >= 15) mechc_rk_use(run, &mechc_radau5), any = 1;
        any |= run->head.status != MECHC_RUNNING;
    }
    return any;
}

/* Judge a step of every lane and go on from it; 1 where a run is to leave. */
MECHC_STATIC int mechc_abreast_go_on(struct mechc_abreast *a, mechc_rk_run **runs, int count,
                                     int dense)
{
    mechc_lane rows[MECHC_MOST_DENSE * MECHC_NX];
    mechc_lane_mask leaves;
    const mechc_lane_mask accepted = mechc_abreast_judge(a, &leaves);
    if (dense) mechc_abreast_dense(a, rows);
    mechc_abreast_accept(a, accepted, leaves);
    return mechc_abreast_part(a, runs, count, accepted, leaves, rows);
}

/* Up to `steps` attempts of each run, fewer where one of them ends or goes on alone; the attempts
 * made. */
MECHC_STATIC long mechc_abreast_advance(mechc_rk_run **runs, int count, long steps)
{
    struct mechc_abreast a;
    int dense = 0, parted = 0;
    long made = 0;
    for (int lane = 0; lane < MECHC_LANES; lane++) {
        const mechc_rk_run *run = runs[lane < count ? lane : 0]; /* idle lanes repeat the first */
        mechc_abreast_load(&a, lane, run);
        dense |= run->head.trajectory.dense_rows;
    }
    for (; made < steps && !parted; made++) {
        mechc_abreast_step(&a);
        parted = mechc_abreast_go_on(&a, runs, count, dense);
    }
    for (int lane = 0; lane < count; lane++) mechc_abreast_store(&a, lane, runs[lane]);
    return made;
}
#else
MECHC_STATIC long mechc_abreast_advance(mechc_rk_run **runs, int count, long steps)
{
    (void)runs, (void)count, (void)steps;
    return 0;
}
#endif

/* Attempts that a run still has, of those asked for. */
MECHC_STATIC long mechc_abreast_left(const mechc_rk_run *run, long steps)
{
    const long left = run->max_steps - run->head.stats.steps - run->head.stats.rejected;
    return left < steps ? left : steps;
}

/* Up to `steps` attempts of each of up to MECHC_LANES runs; returns early where one that ran beside
 * others has ended or goes on alone. */
static void mechc_unit_advance_abreast(mechc_run **heads, int count, long steps)
{
    mechc_rk_run *together[MECHC_LANES];
    int fit = 0;
    long least = steps;
    for (int i = 0; i < count; i++) {
        mechc_rk_run *run = (mechc_rk_run *)heads[i];
        if (run->head.status != MECHC_RUNNING) continue;
        if (mechc_abreast_left(run, steps) > 0 && mechc_abreast_fits(run)) {
            together[fit++] = run;
            least = mechc_abreast_left(run, least);
        } else {
            mechc_rk_advance_alone(run, steps);
        }
    }
    if (fit) mechc_abreast_advance(together, fit, least);
}

static int mechc_unit_advance(mechc_run *head, long steps)
{
    mechc_rk_run *run = (mechc_rk_run *)head;
    while (head->status == MECHC_RUNNING && steps > 0) {
        const long most = mechc_abreast_left(run, steps);
        if (most > 0 && mechc_abreast_fits(run))
            steps -= mechc_abreast_advance(&run, 1, most);
        else
            steps -= mechc_rk_advance_alone(run, steps);
    }
    return head->status;
}
