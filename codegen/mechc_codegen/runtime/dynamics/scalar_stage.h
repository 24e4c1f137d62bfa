/* A stage of one trajectory. */
#pragma once

#include "simd/bind_scalar.h"
#include "dynamics/stage.h"
#include "simd/unbind.h"
