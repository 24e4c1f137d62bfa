/* What a tape is made of: operations on numbered values, and functions with the arrays that each is given.
 *
 * The emitter reads these lists (emit/tape/assembler.py). */
#pragma once

/* X(name): with the registers a, b, c as operands unless it is said otherwise. */
#define MECHC_TAPE_OPERATIONS(X) \
    X(NUMBER)   /* constant a */ \
    X(SCALAR)   /* scalar argument a */ \
    X(LOAD)     /* array a, element b */ \
    X(INPUT)    /* input a of those read last */ \
    X(STORE)    /* array a, element b <- register c */ \
    X(CLEAR)    /* array a, so many elements from the first <- 0 */ \
    X(INPUTS_READ) /* inputs a .. b - 1; c: they may need the speeds */ \
    X(SINE_COSINE) /* of a; the cosine to register b */ \
    X(TURN)     /* the same; kept as turn c */ \
    X(ADD) X(SUBTRACT) X(MULTIPLY) X(DIVIDE) X(NEGATE) \
    X(FMA) X(FNMA) X(FMS) X(FNMS) X(SQRT) \
    X(LESS) X(LESS_EQUAL) X(EQUAL) X(NOT_EQUAL) X(AND) X(NOT) /* masks */ \
    X(SELECT) \
    X(CALL)     /* function b of a */ \
    X(CALL2)    /* function c of a, b */ \
    X(LOOKUP)   /* table c of a, b */ \
    X(RETURN)   /* register a */ \
    X(END)

#define MECHC_TAPE_CALLS(X) \
    X(fabs) X(floor) X(sin) X(cos) X(tan) X(asin) X(acos) X(atan) X(sinh) X(cosh) X(tanh) X(exp) X(log)
#define MECHC_TAPE_CALLS_OF_TWO(X) X(pow) X(atan2)

/* X(name, number of elements by the counts c). */
#define MECHC_TAPE_ARRAYS(X) \
    X(q, c->nq) X(u, c->nu) X(p, c->np) X(k, c->nk) X(saved, c->saved) X(a, c->nu) X(l, c->nc) \
    X(gap, c->nh) X(jacobian, c->nc * c->nu) X(bias, c->nc) X(mass, c->nu * c->nu) \
    X(forcing, c->nu) X(gamma, c->nc) X(out, width) \
    X(weight, c->nu) X(kept, c->blocks_kept) X(directions, c->nu * free) \
    X(momenta, c->nu * free) X(own, free) X(lengths, c->nc) X(clear, 1) \
    X(values, c->nc) X(x, c->nu) X(moved, c->nu) X(axes, c->nu * free) \
    X(inverse, free) X(reaction, c->nu) X(lambda, c->nc) X(rates, c->nc) \
    X(row, series->row) X(series_kept, series->kept) X(sums, series->sums) \
    X(series_rates, series->integrated) X(c, c->nu + c->nc + (c->identity_kinematics ? 0 : c->nq)) \
    X(tree_offset, c->links * arm) X(tree_subspace, c->columns * dim) X(tree_inertia, c->links * masses) \
    X(tree_reference, c->nc ? c->links * arm : 0) X(tree_cut, c->pairs * (3 * arm + (c->moments ? 2 * arm - 3 : 0))) X(tree_saved, c->saved - c->of_tree) \
    X(tree_bias, c->links * dim) X(tree_wrench, c->links * dim)

/* X(function, its arrays: A(given) W(written), whose names in C lack series_ and tree_): those that the unit calls by themselves, then those of states,
 * plain, or with accelerations and multipliers, and of a parameter's default. */
#define MECHC_TAPE_FUNCTIONS(X) \
    X(hoist, A(p) W(k)) \
    X(configuration, A(q) A(p) A(k) W(gap) W(jacobian) W(bias) W(mass) W(saved)) \
    X(motion, A(q) A(u) A(p) A(k) A(saved) W(forcing) W(gamma)) \
    X(tree_configuration, A(q) A(p) A(k) W(gap) W(bias) W(tree_offset) W(tree_subspace) W(tree_inertia) \
      W(tree_reference) W(tree_cut) W(tree_saved)) \
    X(tree_motion, A(q) A(u) A(p) A(k) A(tree_saved) W(tree_bias) W(tree_wrench) W(gamma)) \
    X(factor_blocks, A(jacobian) A(mass) A(weight) W(kept) W(directions) W(momenta) W(own) W(lengths) W(clear)) \
    X(solve_blocks, A(jacobian) A(kept) A(values) W(x)) \
    X(longest_answer, A(jacobian) A(kept) A(moved) A(axes) A(inverse)) \
    X(block_multipliers, A(jacobian) A(kept) A(reaction) W(lambda)) \
    X(rates_in_blocks, A(jacobian) A(x) W(rates)) \
    X(series_start, A(q) A(u) A(p) A(k) W(series_kept) W(row) W(series_rates)) \
    X(series_next, A(p) A(k) A(series_kept) A(sums) W(row) W(series_rates)) \
    X(series_solve, A(p) A(k) A(series_kept) A(sums) W(row)) \
    X(plain, A(q) A(u) A(p) A(k) W(out)) \
    X(solved, A(q) A(u) A(p) A(k) W(out) A(a) A(l)) \
    X(adjoint, A(q) A(u) A(p) A(k) W(out) A(a) A(l) A(c)) \
    X(default, A(p) W(out))

/* X(name, function, number of results, whether it must be there): functions of states by the names of outputs.
 * `states`, `motion`: numbers of components and of equations; `varies`: whether runs have derivatives. */
#define MECHC_TAPE_NAMED(X) \
    X(constraints, plain, c->nh, c->nh > 0) \
    X(coordinate_rates, plain, c->nq, !c->identity_kinematics) \
    X(kinematic_matrix, plain, c->nq * c->nu, !c->identity_kinematics) \
    X(switching, plain, c->switches, c->switches > 0) \
    X(mass_matrix, plain, c->nu * c->nu, 0) \
    X(residual_adjoint, adjoint, states + c->np + c->ni, 0) \
    X(residual_by_state, solved, motion * states, varies) \
    X(residual_by_parameters, solved, motion * c->np, varies && c->np) \
    X(residual_by_inputs, solved, motion * c->ni, varies && c->ni) \
    X(rate_by_state, plain, c->nq * states, varies && !c->identity_kinematics) \
    X(rate_by_parameters, plain, c->nq * c->np, varies && !c->identity_kinematics && c->np) \
    X(rate_by_inputs, plain, c->nq * c->ni, varies && !c->identity_kinematics && c->ni) \
    X(constraint_jacobian, plain, c->nc * c->nu, varies && c->nc && !c->links) \
    X(velocity_gradient, plain, c->nc * c->nq, varies && c->nc) \
    X(constraint_gradient, plain, c->nh * c->nq, varies && c->nh && !c->identity_kinematics) \
    X(constraints_by_parameters, plain, c->nh * c->np, 0) \
    X(constraints_by_inputs, plain, c->nh * c->ni, 0) \
    X(velocity_constraints_by_parameters, plain, c->nc * c->np, 0) \
    X(velocity_constraints_by_inputs, plain, c->nc * c->ni, 0)

#define MECHC_TAPE_HIGHEST_DEGREE 15 /* of a table's polynomials */
#define MECHC_TAPE_MOST_ARRAYS 11
#define MECHC_TAPE_MOST_REGISTERS 8192
#define MECHC_TAPE_MOST_OUTPUTS 128
#define MECHC_TAPE_WIDEST 32767 /* numbers of an output */

#define MECHC_TAPE_NAME(name) MECHC_TAPE_##name,
enum { MECHC_TAPE_OPERATIONS(MECHC_TAPE_NAME) MECHC_TAPE_OPERATION_COUNT };
#undef MECHC_TAPE_NAME
#define MECHC_TAPE_NAME(name) MECHC_TAPE_CALL_##name,
enum { MECHC_TAPE_CALLS(MECHC_TAPE_NAME) MECHC_TAPE_CALL_COUNT };
enum { MECHC_TAPE_CALLS_OF_TWO(MECHC_TAPE_NAME) MECHC_TAPE_CALL_OF_TWO_COUNT };
#undef MECHC_TAPE_NAME
#define MECHC_TAPE_NAME(name, ...) MECHC_TAPE_OF_##name,
enum { MECHC_TAPE_FUNCTIONS(MECHC_TAPE_NAME) MECHC_TAPE_FUNCTION_COUNT };
#undef MECHC_TAPE_NAME
#define MECHC_TAPE_NAME(name, ...) MECHC_TAPE_NAMED_##name,
enum { MECHC_TAPE_NAMED(MECHC_TAPE_NAME) MECHC_TAPE_NAMED_COUNT };
#undef MECHC_TAPE_NAME
