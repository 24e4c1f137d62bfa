/* Constants of sine and cosine. */
#pragma once

/* Beyond this, n * PIO2_A is no longer exact and the C library takes over. */
#define MECHC_REDUCTION_LIMIT 1.0e6

/* Beyond this change of an angle its sine and cosine are computed afresh. */
#define MECHC_NEAR_ANGLE 1.0e-3

/* pi/2 in three parts of 33 bits each (Cody & Waite 1980), and 2/pi. */
#define MECHC_TWO_OVER_PI 0x1.45f306dc9c883p-1
#define MECHC_PIO2_A 0x1.921fb544p+0
#define MECHC_PIO2_B 0x1.0b4611a6p-34
#define MECHC_PIO2_C 0x1.3198a2e037073p-69
#define MECHC_ROUND 0x1.8p+52 /* adding it rounds to an integer kept in the low bits */

/* sin r = r + r z P(z), cos r = 1 - z/2 + z z Q(z), z = r r, |r| <= pi/4; minimax fits of our own
 * (Remez exchange in 60 digits): relative errors 3.4e-18 and 4.7e-20 before rounding. */
#define MECHC_P0 -0x1.5555555555549p-3
#define MECHC_P1 0x1.111111110f881p-7
#define MECHC_P2 -0x1.a01a019c126a3p-13
#define MECHC_P3 0x1.71de35787391ep-19
#define MECHC_P4 -0x1.ae5e66d4319e7p-26
#define MECHC_P5 0x1.5d932f1091513p-33
#define MECHC_Q0 0x1.555555555554cp-5
#define MECHC_Q1 -0x1.6c16c16c15184p-10
#define MECHC_Q2 0x1.a01a019cb26e1p-16
#define MECHC_Q3 -0x1.27e4f80a75b6ap-22
#define MECHC_Q4 0x1.1ee9ec474473cp-29
#define MECHC_Q5 -0x1.8faecef5e5fd5p-37
