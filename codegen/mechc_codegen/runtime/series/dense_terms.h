/* The dense output (run/dense_output.h) of a step from the terms of its series. */
#pragma once

#include "run/tableau.h"

#define MECHC_DENSE_PAIRS 16 /* of rows, filled up to whole vectors */

/* Of the polynomial s (a0 + a1 s + a2 s^2 + ...) row 2m is the sum of (-1)^m C(k - m, m) ak, and row 2m + 1 is
 * minus that of the same numbers and a(k + 1): division by 1 - s gives minus the sums of all higher
 * terms, division by s leaves the first out.  A line for each k. */
static const double mechc_dense_of_terms[MECHC_TAYLOR_MOST][MECHC_DENSE_PAIRS]
    __attribute__((aligned(64), unused)) = {
    {1},
    {1},
    {1, -1},
    {1, -2},
    {1, -3, 1},
    {1, -4, 3},
    {1, -5, 6, -1},
    {1, -6, 10, -4},
    {1, -7, 15, -10, 1},
    {1, -8, 21, -20, 5},
    {1, -9, 28, -35, 15, -1},
    {1, -10, 36, -56, 35, -6},
    {1, -11, 45, -84, 70, -21, 1},
    {1, -12, 55, -120, 126, -56, 7},
    {1, -13, 66, -165, 210, -126, 28, -1},
    {1, -14, 78, -220, 330, -252, 84, -8},
    {1, -15, 91, -286, 495, -462, 210, -36, 1},
    {1, -16, 105, -364, 715, -792, 462, -120, 9},
    {1, -17, 120, -455, 1001, -1287, 924, -330, 45, -1},
    {1, -18, 136, -560, 1365, -2002, 1716, -792, 165, -10},
    {1, -19, 153, -680, 1820, -3003, 3003, -1716, 495, -55, 1},
    {1, -20, 171, -816, 2380, -4368, 5005, -3432, 1287, -220, 11},
    {1, -21, 190, -969, 3060, -6188, 8008, -6435, 3003, -715, 66, -1},
    {1, -22, 210, -1140, 3876, -8568, 12376, -11440, 6435, -2002, 286, -12},
    {1, -23, 231, -1330, 4845, -11628, 18564, -19448, 12870, -5005, 1001, -78, 1},
    {1, -24, 253, -1540, 5985, -15504, 27132, -31824, 24310, -11440, 3003, -364, 13},
};
