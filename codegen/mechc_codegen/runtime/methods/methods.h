/* The methods by their numbers: adding one is a number in abi/codes.h, its file, a line here. */
#pragma once

#include "methods/dormand_prince.h"
#include "methods/gauss.h"
#include "methods/radau.h"
#include "run/method.h"

static const mechc_method *const mechc_methods[MECHC_METHODS] = {
    [MECHC_DOPRI5] = &mechc_dopri5,
    [MECHC_DOP853] = &mechc_dop853,
    [MECHC_RADAU5] = &mechc_radau5,
    [MECHC_GAUSS8] = &mechc_gauss8,
};
