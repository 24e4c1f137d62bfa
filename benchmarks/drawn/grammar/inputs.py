"""Inputs: functions of time that are compiled in, or given with a run as all kinds of values."""

from __future__ import annotations

from .writer import Writer


def written(w: Writer, q: list[str]) -> str:
    """A specified function of time, and what it is; one a scene."""
    if "F_in" in w.inputs:
        return "F_in"
    w.inputs.append("F_in")
    w.line('F_in = dynamicsymbols("F_in")')
    if w.chance(0.35):
        w.note("input compiled in")
        x = w.one_of(q)
        if w.chance(0.4):
            a, b, k = (round(w.between(0.2, 1.5), 2) for _ in range(3))
            w.line(f"in_sympy = {{F_in: {a} * sm.cos({b} * t) - {k} * {x}}}")
            w.given["inputs"] = f'{{"F_in": "{a}*cos({b}*t) - {k}*{x}"}}'
            return "F_in"
        law = f"{w.signed('F', 1.0)} * sm.cos({w.value('w', 0.5, 2.0)} * t)"
        w.line(f"in_sympy = {{F_in: {law} - {w.value('k', 0.1, 1.0)} * {x}}}")
        w.given["inputs"] = "in_sympy"
        return "F_in"
    kind = w.one_of(["number", "text", "function", "lines", "spline"])
    w.note(f"input: {kind}")
    a, b = round(w.between(-1, 1), 2), round(w.between(0.5, 2.5), 2)
    if kind == "number":
        w.line(f"in_sympy, inputs = {{F_in: sm.Float({a})}}, {{F_in: {a}}}")
    elif kind == "text":
        w.line(f"in_sympy = {{F_in: {a} * sm.sin({b} * t) - {b} * {q[0]}}}")
        w.line(f'inputs = {{"F_in": "{a}*sin({b}*t) - {b}*{q[0]}"}}')
    elif kind == "function":
        w.line(f"in_sympy = {{F_in: {a} * sm.sin({b} * t)}}")
        w.line("import math")
        w.line(f"inputs = {{F_in: lambda t: {a} * math.sin({b} * t)}}")
    else:
        _sampled(w, kind)
    return "F_in"


def prescribed(w: Writer) -> str:
    """A function of time alone that has two derivatives, for constraints."""
    w.inputs.append("F_in")
    w.line('F_in = dynamicsymbols("F_in")')
    kind = w.one_of(["compiled in", "number", "text", "three functions", "spline"])
    w.note(f"prescribed: {kind}")
    if kind == "spline":
        _sampled(w, kind)
        return "F_in"
    a, b = round(w.between(0.2, 1), 2), round(w.between(0.5, 2.5), 2)
    law = str(a) if kind == "number" else f"{a} * sm.sin({b} * t)"
    w.line(f"in_sympy = {{F_in: sm.sympify({law})}}")
    if kind == "compiled in":
        w.given["inputs"] = "in_sympy"
    elif kind == "three functions":
        w.line("laws = [sm.lambdify(t, in_sympy[F_in].diff(t, k)) for k in range(3)]")
        w.line("inputs = {F_in: tuple(laws)}")
    else:
        w.line(f"inputs = {{F_in: {a if kind == 'number' else repr(law.replace('sm.', ''))}}}")
    return "F_in"


def _sampled(w: Writer, kind: str) -> None:
    """Samples that reach beyond every run, as lines or a spline."""
    times = [0.0, 0.7, 1.3, 2.1, 3.5]
    values = [round(w.between(-1, 1), 2) for _ in times]
    w.line(f"times, values = {times}, {values}")
    if kind == "lines":
        w.line("inputs = {F_in: (times, values)}")
        w.line("pieces = [(values[k] + (values[k + 1] - values[k]) * (t - times[k])"
               " / (times[k + 1] - times[k]), t < times[k + 1]) for k in range(4)]")  # fmt: skip
        w.line("in_sympy = {F_in: sm.Piecewise(*pieces[:-1], (pieces[-1][0], True))}")
    else:
        w.line("from scipy.interpolate import CubicSpline")
        w.line("spline = CubicSpline(times, values)")
        w.line("inputs = {F_in: spline}" if w.chance(0.5) else
               'inputs = {F_in: mechc.Signal(times, values, "cubic")}')  # fmt: skip
        w.line("pieces = [(sum(float(c) * (t - times[k])**(3 - j) for j, c in "
               "enumerate(spline.c[:, k])), t < times[k + 1]) for k in range(4)]")  # fmt: skip
        w.line("in_sympy = {F_in: sm.Piecewise(*pieces[:-1], (pieces[-1][0], True))}")
