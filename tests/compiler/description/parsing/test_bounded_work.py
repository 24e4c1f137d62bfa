"""No text makes SymPy work for long, however short it is."""

import cProfile
import pstats
import sys
import time

import pytest
from mechc_codegen.description.parsing.bounded_work import TooMuchWorkError, with_at_most
from mechc_codegen.description.parsing.parser import parse_expression
from mechc_codegen.errors import ExpressionError
from sympy.physics.mechanics import dynamicsymbols

NAMES = {"t": dynamicsymbols._t}


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize(
    "text", ["log(tanh(tan(cos(1/t))**-12))", "1 + log(tanh(tan(cos(1/t))**-10))"]
)
def test_a_short_text_that_takes_minutes_is_refused_in_seconds(text):
    started = time.process_time()
    with pytest.raises(ExpressionError, match="too long"):
        parse_expression(text, NAMES)
    assert time.process_time() - started < 10


def test_a_long_text_that_takes_little_is_read():
    terms = [f"{k}.5*sin({k}*t + 0.{k})*exp(-t/{k})" for k in range(1, 25)]
    assert len(parse_expression("+".join(terms), NAMES).args) == 24


def test_what_watched_python_before_watches_it_again():
    def watch(*_):
        pass

    def endless():
        while True:
            len([])
            watch()

    before = sys.getprofile()
    sys.setprofile(watch)
    try:
        with pytest.raises(TooMuchWorkError):
            with_at_most(100, endless)
        assert sys.getprofile() is watch
        assert with_at_most(100, lambda: 1) == 1
        assert sys.getprofile() is watch
    finally:
        sys.setprofile(before)


def test_pythons_own_profiler_goes_on():
    def counted():
        pass

    profiler = cProfile.Profile()
    profiler.enable()
    try:
        assert str(parse_expression("sin(2*t)", NAMES)) == "sin(2*t)"
        counted()
    finally:
        profiler.disable()
    assert any(name == "counted" for _, _, name in pstats.Stats(profiler).stats)
