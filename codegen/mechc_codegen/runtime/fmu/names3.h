/* Names and types of FMI 3.0 that differ from those of FMI 2.0. */
#pragma once

#include <stdbool.h>

typedef bool mechc_fmi_bool;
typedef void mechc_fmi_log(void *environment, int status, const char *category,
                           const char *message);
#define MECHC_FMI_NAME(name) fmi3##name
#define MECHC_FMI_COUNT(name) , size_t name
#define MECHC_FMI_AS_MANY(values, references) ((values) == (references))
#define MECHC_FMI_SAY(log, environment, name, message) \
    log(environment, MECHC_FMU_ERROR, "logStatusError", message)
