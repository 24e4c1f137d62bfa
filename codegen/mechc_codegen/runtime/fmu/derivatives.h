/* Directional and adjoint derivatives of rates and outputs by states, parameters and inputs. */
#pragma once

#include "fmu/instance.h"

#define MECHC_FMU_UNKNOWNS (MECHC_NX + MECHC_FMU_VALUES)
#define MECHC_FMU_UNKNOWNS_MAX (MECHC_NX_MAX + MECHC_FMU_VALUES)
typedef char mechc_rows_of_unit[!MECHC_STATE_JACOBIAN || MECHC_OWN == MECHC_FMU_VALUES ? 1 : -1];

/* Jacobians of rates, then outputs, by states, parameters and values of inputs: each row by row. */
typedef struct {
    double by_state[MECHC_FMU_UNKNOWNS_MAX * MECHC_NX_MAX];
    double by_parameter[MECHC_AT_LEAST_ONE(MECHC_FMU_UNKNOWNS_MAX * MECHC_NP_MAX)];
    double by_input[MECHC_AT_LEAST_ONE(MECHC_FMU_UNKNOWNS_MAX * MECHC_NI_MAX)];
} mechc_fmu_jacobian;

/* A direction of the knowns, and the changes that follow from it. */
typedef struct {
    double y[MECHC_NX_MAX], p[MECHC_AT_LEAST_ONE(MECHC_NP_MAX)], inputs[MECHC_AT_LEAST_ONE(MECHC_NI_MAX)];
} mechc_fmu_direction;

MECHC_STATIC void mechc_fmu_linearise(mechc_fmu *fmu, mechc_fmu_jacobian *to)
{
    const mechc_standalone *model = mechc_fmu_current(fmu);
    const double t = fmu->now.t, *y = fmu->now.y;
    memset(to, 0, sizeof *to);
    (void)model, (void)t, (void)y;
#if MECHC_OWN > 0
#define MECHC_FMU_JACOBIAN(name, out, columns)                                                    \
    mechc_standalone_##name(model, t, y, out);                                                    \
    mechc_standalone_own_##name(model, t, y, (out) + MECHC_NX * (columns))
#else
#define MECHC_FMU_JACOBIAN(name, out, columns) mechc_standalone_##name(model, t, y, out)
#endif
#if MECHC_STATE_JACOBIAN
    MECHC_FMU_JACOBIAN(state_jacobian, to->by_state, MECHC_NX);
#endif
#if MECHC_PARAMETER_JACOBIAN
    MECHC_FMU_JACOBIAN(parameter_jacobian, to->by_parameter, MECHC_NP);
#endif
#if MECHC_INPUT_JACOBIAN
    MECHC_FMU_JACOBIAN(input_jacobian, to->by_input, MECHC_NI);
#endif
}

/* The place where a direction stores a known variable; NULL if nothing depends on it. */
MECHC_STATIC double *mechc_fmu_known(mechc_fmu_direction *along, uint32_t reference)
{
    const int64_t r = reference, parameter = r - MECHC_OF_PARAMETERS;
    if (mechc_fmu_within(r, MECHC_OF_STATES, MECHC_OF_RATES)) return &along->y[r - MECHC_OF_STATES];
    if (mechc_fmu_within(r, MECHC_OF_PARAMETERS, MECHC_OF_DRIFT)
        && !mechc_fmu_scene.calculated[parameter])
        return &along->p[parameter];
    if (mechc_fmu_within(r, MECHC_OF_INPUTS, MECHC_OF_OUTPUTS))
        return &along->inputs[mechc_fmu_scene.inputs[r - MECHC_OF_INPUTS]];
    return 0;
}

MECHC_STATIC double mechc_fmu_dot(const double *row, const double *along, int count)
{
    double sum = 0.0;
    for (int i = 0; i < count; i++) sum += along[i] == 0.0 ? 0.0 : row[i] * along[i];
    return sum;
}

/* The rate of change of an unknown; 0 if the reference is no unknown. */
MECHC_STATIC int mechc_fmu_change(const mechc_fmu_jacobian *of, const mechc_fmu_direction *along,
                                  uint32_t reference, double *change)
{
    const int64_t r = reference;
    const int rate = mechc_fmu_within(r, MECHC_OF_RATES, MECHC_OF_PARAMETERS);
    if (mechc_fmu_within(r, MECHC_OF_STATES, MECHC_OF_RATES)) *change = along->y[r - MECHC_OF_STATES];
    else if (mechc_fmu_within(r, MECHC_OF_PARAMETERS, MECHC_OF_DRIFT))
        *change = along->p[r - MECHC_OF_PARAMETERS];
    else if (!rate && !mechc_fmu_within(r, MECHC_OF_OUTPUTS, MECHC_OF_EVENTS)) return 0;
    else {
        const int64_t row = rate ? r - MECHC_OF_RATES : MECHC_NX + r - MECHC_OF_OUTPUTS;
        *change = mechc_fmu_dot(of->by_state + row * MECHC_NX, along->y, MECHC_NX)
                + mechc_fmu_dot(of->by_parameter + row * MECHC_NP, along->p, MECHC_NP)
                + mechc_fmu_dot(of->by_input + row * MECHC_NI, along->inputs, MECHC_NI);
    }
    return 1;
}

MECHC_STATIC int mechc_fmu_changes(mechc_fmu *fmu, const mechc_fmu_jacobian *of,
                                   mechc_fmu_direction *along, const uint32_t *unknowns,
                                   size_t count, double *changes)
{
    mechc_fmu_scene.follow(fmu->now.p, along->p);
    for (size_t i = 0; i < count; i++)
        if (!mechc_fmu_change(of, along, unknowns[i], &changes[i])) return 0;
    return 1;
}

#define MECHC_FMU_NOT_DIFFERENTIATED "no derivative exists of or by this variable"
#define MECHC_FMU_NO_DERIVATIVES "the unit was exported without derivatives"

/* Compute changes = d unknowns / d knowns seed. */
MECHC_STATIC mechc_fmu_status mechc_fmu_directional(
    mechc_fmu *fmu, const uint32_t *unknowns, size_t unknown_count, const uint32_t *knowns,
    size_t known_count, const double *seed, double *changes)
{
    mechc_fmu_direction along;
    if (!MECHC_STATE_JACOBIAN) return mechc_fmu_fails(fmu, MECHC_FMU_NO_DERIVATIVES);
    mechc_fmu_jacobian *of = malloc(sizeof *of);
    if (!of) return mechc_fmu_fails(fmu, "no memory");
    int right = 1;
    memset(&along, 0, sizeof along);
    mechc_fmu_linearise(fmu, of);
    for (size_t i = 0; i < known_count && right; i++) {
        double *place = mechc_fmu_known(&along, knowns[i]);
        right = place != 0;
        if (place) *place += seed[i];
    }
    right = right && mechc_fmu_changes(fmu, of, &along, unknowns, unknown_count, changes);
    free(of);
    return right ? MECHC_FMU_OK : mechc_fmu_fails(fmu, MECHC_FMU_NOT_DIFFERENTIATED);
}

/* Compute gradient = seed^T d unknowns / d knowns. */
MECHC_STATIC mechc_fmu_status mechc_fmu_adjoint(
    mechc_fmu *fmu, const uint32_t *unknowns, size_t unknown_count, const uint32_t *knowns,
    size_t known_count, const double *seed, double *gradient)
{
    if (!MECHC_STATE_JACOBIAN) return mechc_fmu_fails(fmu, MECHC_FMU_NO_DERIVATIVES);
    mechc_fmu_jacobian *of = malloc(sizeof *of);
    double *changes = malloc((unknown_count + 1) * sizeof *changes);
    int right = 0;
    if (of && changes) {
        mechc_fmu_linearise(fmu, of);
        right = 1;
        for (size_t i = 0; i < known_count && right; i++) { /* along one of them after the other */
            mechc_fmu_direction along;
            memset(&along, 0, sizeof along);
            double *place = mechc_fmu_known(&along, knowns[i]);
            if (place) *place = 1.0;
            right = place && mechc_fmu_changes(fmu, of, &along, unknowns, unknown_count, changes);
            gradient[i] = 0.0;
            for (size_t k = 0; right && k < unknown_count; k++) gradient[i] += seed[k] * changes[k];
        }
    }
    free(of);
    free(changes);
    return right ? MECHC_FMU_OK : mechc_fmu_fails(fmu, MECHC_FMU_NOT_DIFFERENTIATED);
}
