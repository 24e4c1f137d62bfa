/* Names and types of FMI 2.0 that differ from those of FMI 3.0. */
#pragma once

typedef int mechc_fmi_bool;
typedef void mechc_fmi_log(void *environment, const char *name, int status, const char *category,
                           const char *message, ...);
#define MECHC_FMI_NAME(name) fmi2##name
#define MECHC_FMI_COUNT(name) /* references alone are counted */
#define MECHC_FMI_AS_MANY(values, references) 1
#define fmi2GetFloat64 fmi2GetReal
#define fmi2SetFloat64 fmi2SetReal
#define fmi2GetFMUState fmi2GetFMUstate
#define fmi2SetFMUState fmi2SetFMUstate
#define fmi2FreeFMUState fmi2FreeFMUstate
#define fmi2SerializedFMUStateSize fmi2SerializedFMUstateSize
#define fmi2SerializeFMUState fmi2SerializeFMUstate
#define fmi2DeserializeFMUState fmi2DeSerializeFMUstate
#define fmi2GetContinuousStateDerivatives fmi2GetDerivatives
#define MECHC_FMI_SAY(log, environment, name, message) \
    log(environment, name, MECHC_FMU_ERROR, "logStatusError", "%s", message)
