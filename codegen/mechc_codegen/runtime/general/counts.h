/* The counts and tables of one scene, for the unit that serves all. */
#pragma once

typedef struct {
    int nq, nu, nh, nc, np, nk, saved, turns, ni, states, switches, features, knotted, multipliers, lockstep;
    const unsigned char *slides; /* of the state; NULL: none does */
    int angle_count, periodic_count;
    const int *angles, *periodic;
    const double *knots, *knots_period;
    const int *knots_begin;
    int blocks_kept, row_blocks, identity_kinematics, own;
    int links, planar, columns, speeds_shared, carried, factors, moving_cuts, pairs, moments, several_loops;
    int of_tree; /* numbers that a configuration keeps of the tree */
    const int *parent, *first_column, *column_speed, *cut, *first_pair; /* of links: see dynamics/tree.h, loops/rows.h */
    const int *first_row, *cut_place, *handed_to, *row_taken, *first_factor;
    int varies, gradient, gap_by_parameters, gap_by_inputs, gap_rate_by_parameters, gap_rate_by_inputs;
} mechc_counts;

#ifdef MECHC_OPENS_TAPES /* which tell them */
extern __attribute__((visibility("hidden"))) mechc_counts mechc_of_scene;
#else
extern __attribute__((visibility("hidden"))) const mechc_counts mechc_of_scene;
#endif
