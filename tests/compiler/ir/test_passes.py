"""Every pass keeps the value of every output, leaves a legal program and adds no work."""

from __future__ import annotations

import hashlib
import os
import random
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

import mpmath
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mechc_codegen import build_scene
from mechc_codegen.derive.equations import Output, Symbols
from mechc_codegen.errors import InternalError
from mechc_codegen.ir.passes import collect, drop, eliminate_common, hoist, pair
from mechc_codegen.ir.passes.collect import cost
from mechc_codegen.ir.passes.optimize import PASSES, optimize
from mechc_codegen.ir.program import (
    Assign,
    Program,
    SineCosine,
    count_operations,
    operations,
    targets_of,
)
from sympy import (
    Abs,
    Expr,
    Float,
    Integer,
    Rational,
    S,
    Symbol,
    cos,
    count_ops,
    exp,
    sin,
    sqrt,
    tan,
)
from sympy.core.function import UndefinedFunction

from tests.support import ROOT, scenes

Pass = Callable[[Program], Program]


def real(name: str) -> Symbol:
    return Symbol(name, real=True)


t, q, w, u = real("t"), real("q0"), real("q1"), real("u0")
a, b, c = real("p0"), real("p1"), real("p2")
x, y = real("z0"), real("z1")
SYMBOLS = Symbols(t, (q, w), (u,), (a, b, c))
DIGITS = 60
SAME = mpmath.mpf(10) ** -25


def output(name: str, *elements: Expr) -> Output:
    labels = tuple(f"{name}[{k}]" for k in range(len(elements)))
    return Output(name, f"the {name}", tuple(map(S, elements)), (len(elements),), labels)


def program(*elements: Expr) -> Program:
    return Program(SYMBOLS, (output("out", *elements),))


def results(done: Program) -> tuple[Expr, ...]:
    return done.outputs[0].elements


def inputs(symbols: Symbols, seed: int) -> dict[Symbol, mpmath.mpf]:
    rng = random.Random(seed)
    named = (symbols.time, *symbols.q, *symbols.u, *symbols.parameters)
    return {symbol: mpmath.mpf(rng.uniform(0.3, 1.7)) for symbol in named}


def work(done: Program) -> int:
    """Operations but changes of sign; a pair of which only one half is needed counts as one."""
    elements = [e for o in done.outputs for e in o.elements]
    statements = [*done.hoisted, *done.body]
    used = {s for e in [*elements, *(s.value for s in statements)] for s in e.free_symbols}
    halves = sum(not used.issuperset(s.targets) for s in statements if isinstance(s, SineCosine))
    everything = [*elements, *(s.value for s in statements)]
    signs = sum(count_ops(e, visual=True).coeff(Symbol("NEG")) for e in everything)
    return operations(statements, elements) - halves - int(signs)


def check_same_values(before: Program, after: Program, seed: int = 0) -> None:
    with mpmath.workdps(DIGITS):
        known = inputs(before.symbols, seed)
        old, new = scenes.run_program(before, known), scenes.run_program(after, known)
        assert old.keys() == new.keys()
        for name in old:
            for one, other in zip(old[name], new[name], strict=True):
                assert abs(one - other) <= SAME * (1 + abs(one)), name


# -- each pass alone --------------------------------------------------------------------------


def test_pair_makes_one_statement_an_argument() -> None:
    done = pair(program(sin(q) * cos(q), cos(-q), sin(-q), tan(q), sin(q - w) + sin(w - q) * a))
    assert [s.value for s in done.body] in ([q, q - w], [q, w - q])
    first = done.body[0]
    assert isinstance(first, SineCosine)
    s, k = first.targets
    assert results(done)[:4] == (s * k, k, -s, s / k)


def test_pair_reaches_arguments_of_arguments_in_order() -> None:
    done = pair(program(sin(sin(q) + 1))).verify()
    assert [len(s.value.free_symbols) for s in done.body] == [1, 1]
    inner, outer = done.body
    assert outer.value == inner.targets[0] + 1


def test_collect_joins_terms_that_differ_in_parameters() -> None:
    (done,) = results(collect(program(a * b * q * w + c * q * w)))
    assert done == (a * b + c) * q * w
    (through,) = results(collect(program(a * (b * q + c * w) + 2 * b * a * q)))
    assert cost(through, {a, b, c}) < cost(a * (b * q + c * w) + 2 * b * a * q, {a, b, c})


def test_collect_leaves_what_would_cost_more() -> None:
    expression = a * (q + w) + u
    assert results(collect(program(expression))) == (expression,)


def test_collect_sees_a_difference_and_its_negative_as_one() -> None:
    (done,) = results(collect(program(a * (q - w) * u + b * (w - q) * u)))
    assert count_operations(done) < count_operations(a * (q - w) * u + b * (w - q) * u)


def test_hoist_takes_out_what_depends_on_parameters_alone() -> None:
    done = hoist(program(a * b * q, -a * b * w, a**2, q ** (a + b), Integer(3), a))
    values = {s.targets[0]: s.value for s in done.hoisted}
    assert set(values.values()) == {a * b, a**2, a + b}
    product, square, total = (
        next(k for k, v in values.items() if v == value) for value in (a * b, a**2, a + b)
    )
    assert results(done) == (product * q, -product * w, square, q**total, Integer(3), a)


def test_hoist_makes_no_constant_twice() -> None:
    done = hoist(program((a - b) * q, (b - a) * w))
    assert len(done.hoisted) == 1


def test_eliminate_names_what_is_repeated_across_outputs() -> None:
    one = Program(SYMBOLS, (output("one", (q + w) ** 2 * u), output("two", (q + w) ** 2 + a)))
    done = eliminate_common(one)
    assert work(done) < work(one)
    assert all(isinstance(s, Assign) for s in done.body)


def test_eliminate_puts_statements_before_their_use() -> None:
    """Statements that were there are kept, in an order that holds."""
    s, k, kept = real("sin0"), real("cos0"), real("kept")
    before = Program(
        SYMBOLS,
        (output("out", s * (q + w) + k, kept * (q + w) * s),),
        body=(SineCosine(s, k, (q + w) * u), Assign(kept, (q + w) * s)),
    ).verify()
    done = eliminate_common(before).verify()
    assert set(targets_of(done.body)) > {s, k, kept}
    check_same_values(before, done)


def test_drop_keeps_only_what_outputs_need() -> None:
    before = Program(
        SYMBOLS,
        (output("out", y * q),),
        hoisted=(Assign(real("k0"), a * b), Assign(real("k1"), a + b)),
        body=(Assign(x, q * real("k0")), Assign(y, q + real("k1")), Assign(real("z2"), x + y)),
    )
    done = drop(before)
    assert list(targets_of(done.body)) == [y]
    assert list(targets_of(done.hoisted)) == [real("k1")]


def test_optimize_computes_repeated_parts_once() -> None:
    """One range reduction, one square, one constant, nothing else."""
    expression = a * b * sin(q) ** 2 * u
    done = optimize(program(expression, expression * w, a * b * cos(q)))
    assert sum(isinstance(s, SineCosine) for s in done.body) == 1
    assert [s.value for s in done.hoisted] == [a * b]
    assert work(done) <= 2 + 1 + 5


def test_verify_tells_of_an_illegal_program() -> None:
    late = replace(program(q), body=(Assign(x, y), Assign(y, q)))
    twice = replace(program(q), body=(Assign(x, q), Assign(x, w)))
    running = replace(program(q), hoisted=(Assign(x, q),))
    unknown = program(x)
    for wrong in (late, twice, running, unknown):
        with pytest.raises(InternalError, match="bug in mechc"):
            wrong.verify()


def test_a_program_can_be_printed() -> None:
    text = str(optimize(program(a * b * sin(q), cos(q) * w)))
    for line in ("hoisted k0 = p0*p1", "sin0, cos0 = sincos(q0)", "out: out[1] = cos0*q1"):
        assert line in text.splitlines()


# -- properties -------------------------------------------------------------------------------

leaves = st.sampled_from([t, q, w, u, a, b, c, *map(Integer, (-1, 2, 3)), Rational(1, 3)])


def grow(inner: st.SearchStrategy[Expr]) -> st.SearchStrategy[Expr]:
    many = st.lists(inner, min_size=2, max_size=4)
    function: st.SearchStrategy[UndefinedFunction] = st.sampled_from([sin, cos, exp_small, Abs])
    return st.one_of(
        many.map(lambda terms: sum(terms, S.Zero)),
        many.map(product),
        st.tuples(function, inner).map(lambda pair_: pair_[0](pair_[1])),
        st.tuples(inner, st.sampled_from([2, 3, Rational(1, 2), -1, -2])).map(power),
        inner.map(lambda e: -e),
    )


def exp_small(expression: Expr) -> Expr:
    return exp(-(expression**2))


def product(factors: Iterable[Expr]) -> Expr:
    result = S.One
    for factor in factors:
        result *= factor
    return result


def power(both: tuple[Expr, Expr]) -> Expr:
    """Of a positive base, so that values are real and finite."""
    return (both[0] ** 2 + Rational(1, 2)) ** both[1]


def straight(expression: Expr) -> bool:
    return bool(expression.is_real) and expression.is_finite is not False


expressions = st.recursive(leaves, grow, max_leaves=12).filter(straight)
programs = st.lists(expressions, min_size=1, max_size=4).map(lambda e: program(*e))
modest = settings(
    max_examples=60, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)


def prepared(given_: Program, stage: Pass) -> Program:
    """The program as the pass meets it: after those before it."""
    for earlier in PASSES[: PASSES.index(stage)]:
        given_ = earlier(given_)
    return given_


@pytest.mark.parametrize("stage", PASSES, ids=lambda p: p.__name__)
@modest
@given(given_=programs)
def test_a_pass_keeps_values_and_legality(stage: Pass, given_: Program) -> None:
    """Alone, on what was written down, and on what the passes before it leave."""
    for before in (given_, prepared(given_, stage)):
        after = stage(before)
        after.verify()
        check_same_values(before, after)


@pytest.mark.parametrize("stage", PASSES, ids=lambda p: p.__name__)
@modest
@given(given_=programs)
def test_a_pass_adds_no_work(stage: Pass, given_: Program) -> None:
    before = prepared(given_, stage)
    after = stage(before)
    if stage is collect:  # counts what runs at every evaluation
        parameters = set(SYMBOLS.parameters)
        costs = [sum(cost(e, parameters) for e in values(p)) for p in (before, after)]
        assert costs[1] <= costs[0]
    elif stage is hoist:  # moves work to where it is done once a run
        assert work(running(after)) <= work(running(before))
    else:
        assert work(after) <= work(before)


def running(given_: Program) -> Program:
    """What is done at every evaluation."""
    return replace(given_, hoisted=())


def values(given_: Program) -> Iterator[Expr]:
    yield from (s.value for s in given_.body)
    yield from (e for o in given_.outputs for e in o.elements)


@modest
@given(given_=programs)
def test_optimize_keeps_values_and_adds_no_work(given_: Program) -> None:
    after = optimize(given_)
    after.verify()
    check_same_values(given_, after)
    assert work(running(after)) <= work(given_)


@modest
@given(given_=programs)
def test_every_function_left_is_one_the_printer_is_given(given_: Program) -> None:
    """No sine, cosine or tangent is left outside a pair; hoisted parts hold parameters only."""
    after = optimize(given_)
    assert not any(e.has(sin, cos, tan) for e in values(after))


# -- the scenes -------------------------------------------------------------------------------


@pytest.mark.parametrize("scene", scenes.SCENES)
def test_scenes_keep_their_values_through_every_pass(scene: str) -> None:
    before = scenes.lowered(scene)
    done = before
    for stage in PASSES:
        done = stage(done).verify()
        check_same_values(before, done, seed=1)
    assert done == optimize(before)


@pytest.mark.parametrize("scene", scenes.SCENES)
def test_scenes_cost_far_less_after_optimisation(scene: str) -> None:
    before, after = scenes.lowered(scene), optimize(scenes.lowered(scene))
    assert work(running(after)) < (0.8 if scene == "bead" else 0.35) * work(before)


def test_the_four_bar_takes_three_range_reductions() -> None:
    """One an angle, over all outputs together."""
    done = optimize(scenes.lowered("four_bar"))
    pairs = [s.value for s in done.body if isinstance(s, SineCosine)]
    assert sorted(pairs, key=str) == list(done.symbols.q)


def test_floats_are_kept_to_rounding() -> None:
    before = program(Float(9.81) * a * sin(q) + Float(0.1) * b, Float(1e-9) * (q + w) ** 2)
    after = optimize(before)
    known = inputs(SYMBOLS, 3)
    old, new = (scenes.run_program(p, known)["out"] for p in (before, after))
    for one, other in zip(old, new, strict=True):
        assert abs(one - other) <= 4e-16 * abs(one)


EMIT_ALL = """
import hashlib
from tests.support import scenes
from mechc_codegen import build_scene
for name, make in scenes.SCENES.items():
    for file, text in sorted(build_scene(make()).texts.items()):
        print(name, file, hashlib.sha256(text.encode()).hexdigest())
"""


@pytest.mark.slow
def test_emission_is_the_same_text_whatever_the_hash_seed() -> None:
    printed = []
    for seed in ("1", "4242"):
        environment = {**os.environ, "PYTHONHASHSEED": seed}
        printed.append(
            subprocess.run(
                [sys.executable, "-c", EMIT_ALL],
                env=environment,
                cwd=ROOT,
                capture_output=True,
                text=True,
                check=True,
            ).stdout
        )
    assert printed[0] == printed[1]
    assert len(printed[0].splitlines()) >= 5 * len(scenes.SCENES)
    here = build_scene(scenes.SCENES["bead"]()).texts["scene_program.h"]
    assert hashlib.sha256(here.encode()).hexdigest() in printed[0]


def test_square_roots_of_parameters_are_taken_once_a_run() -> None:
    done = optimize(program(sqrt(a) * q, sqrt(a + b) * w))
    assert not any(e.has(sqrt(a), sqrt(a + b)) for e in values(done))
