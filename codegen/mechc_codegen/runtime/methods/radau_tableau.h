/* Radau IIA of order 5, as data. */
#pragma once

#include "run/tableau.h"

#define MECHC_RADAU_STAGES 3

/* Radau IIA, order 5, 3 stages (Radau's quadrature; Hairer & Wanner 1996, section IV.8).  Rate 0 is
 * the start's; the error is that of an embedded formula of order 3, filtered by (I - h g J)^-1. */
#define MECHC_RADAU_GAMMA 0.27488882959567734
static const double mechc_radau5_nodes[MECHC_MOST_RATES] = {
    0, 0.1550510257216822, 0.6449489742783178, 1.0,
};
static const double mechc_radau5_matrix[][MECHC_MOST_RATES] = {
    {0},
    {0, 0.1968154772236604, -0.06553542585019839, 0.02377097434822015},
    {0, 0.3944243147390873, 0.2920734116652285, -0.04154875212599793},
    {0, 0.37640306270046725, 0.5124858261884216, 0.1111111111111111},
};
static const double mechc_radau5_error[MECHC_MOST_RATES] = {
    0, -10.048809399827416, 1.382142733160749, -0.3333333333333333,
};
static const mechc_tableau mechc_radau5_tableau = {
    MECHC_RADAU_STAGES, MECHC_RADAU_STAGES + 1, 3, 4, mechc_radau5_nodes, *mechc_radau5_matrix,
    mechc_radau5_error, 0, 0, 0.0, MECHC_SHARE, 0.0,
};
