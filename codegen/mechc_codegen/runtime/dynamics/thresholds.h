/* What follows from the rounding of numbers.  Exported C in single precision has another header in the
 * place of this one. */
#pragma once

#include <float.h>

/* Squared ratio of norms below which a row is rounding: (16 eps)^2. */
#define MECHC_REDUNDANT 1.3e-29
/* Of the diagonal of the mass matrix: a pivot that is rounding. */
#define MECHC_NO_PIVOT 4e-16
/* Conditioning, squared, above which rows are eliminated link by link. */
#define MECHC_SAFE 2.5e-5
/* The same where singular values are squared: loops/cuts.h. */
#define MECHC_SAFE_SQUARED 1e-3

/* Conditioning, squared, below which the weakest row cannot close a loop any more, and below which
 * it is asked with care what speeds it allows. */
#define MECHC_WEAK 1e-14
#define MECHC_DELICATE 1e-3
/* Below this a row is a redundant one, whose rounding says nothing about a crossing. */
#define MECHC_SURELY 1e-28
/* Conditioning below which a state beside a crossing is spoiled where its speeds follow its rows: these
 * are off by the rounding of the closure over the conditioning, and the speeds by that over it again. */
#define MECHC_TOO_NEAR 3e-4
/* The move over which a rate's change is a difference. */
#define MECHC_SMALL_MOVE 1e-7

/* Of the longest row: a shorter one is redundant, or the start is near a change point. */
#define MECHC_NO_ROW 1e-6
/* A loop is closed whose gap no longer falls, within so many units of rounding. */
#define MECHC_CLOSES 16.0
/* How far each speed is moved to configurations near the start. */
#define MECHC_NEARBY 1e-2
/* How far a direction is followed, and of it a correction that is rounding. */
#define MECHC_FOLLOWED 1e-4
#define MECHC_NO_CORRECTION 1e-6
