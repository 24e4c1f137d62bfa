/* How large the arrays are that a scene and the general unit share: those of dynamics/given.h. */
#pragma once

#define MECHC_NP_MAX 64
#define MECHC_NK_MAX 512
#define MECHC_NI_MAX 8
