"""Values as people type them."""

import math

import numpy as np
import pytest
import xarray

import mechc
from benchmarks.problems.particle import on_a_line
from mechc.errors import MechcError
from mechc.fitting.measured import Measured
from mechc.fitting.recordings import read_recordings
from mechc.system.quantities import Quantity
from mechc.system.quantity import Kind, NamedQuantity
from mechc.system.units import in_si, of_unknown_unit, read_seconds, read_value, split_assignment


def quantity(unit):
    kind = str(mechc.Quantity(unit, "a number").kind)
    return NamedQuantity("x", unit, "a number", -math.inf, math.inf, False, Kind(kind))


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("85deg", "rad", math.radians(85)),
        ("-85 deg", "rad", math.radians(-85)),
        ("85°", "rad", math.radians(85)),
        ("1.5", "rad", 1.5),
        ("1.5rad", "rad", 1.5),
        ("60rpm", "rad/s", 2 * math.pi),
        ("360deg/s", "rad/s", 2 * math.pi),
        ("3500mm", "m", 3.5),
        ("200mm/s", "m/s", 0.2),
        ("20 cm/s", "m/s", 0.2),
        ("36km/h", "m/s", 10.0),
        ("350cm", "m", 3.5),
        ("3.5", "m", 3.5),
        (" 3.5 m ", "m", 3.5),
        ("1e-3", "m", 1e-3),
        ("1.e3mm", "m", 1.0),
        (".5m", "m", 0.5),
        ("+2", "kg", 2.0),
        ("250g", "kg", 0.25),
        ("2kg m^2", "kg m^2", 2.0),
        ("9.81m/s^2", "m/s^2", 9.81),
        ("981 cm/s**2", "m/s^2", 9.81),
        ("9.81 N/kg", "m/s²", 9.81),
        ("1200 g*cm^2", "kg m^2", 1.2e-4),
        ("2 kNm", "N*m", 2000.0),
        ("30 N mm", "kg m^2/s^2", 0.03),
        ("3 N*mm/deg", "N m/rad", 0.54 / math.pi),
        ("3 N*m/rad", "N m", 3.0),
        ("3 N m", "N m/rad", 3.0),
        ("5 N/(mm/s)", "N s/m", 5000.0),
        ("50 N/mm", "N/m", 50e3),
        ("12 in", "m", 0.3048),
        ("30 rev/min", "rad/s", math.pi),
        ("2 ms-1", "1/s", 2000.0),
        ("5 ms", "s", 5e-3),
        ("7 furlongs", "furlongs", 7.0),
        ("30 mm", "", 0.03),
        ("90 deg", "", math.pi / 2),
    ],
)
def test_numbers_with_and_without_unit_are_read_in_si(text, unit, value):
    assert read_value(text, quantity(unit)) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "unit", "told"),
    [
        ("85degg", "rad", r"x: 'degg' in '85degg' is not one of its units; use rad or deg or °"),
        ("85mm", "rad", "'mm' .* use rad or deg"),
        ("3deg", "m", "'deg' .* use m or cm or mm"),
        ("3 3", "m", "'3' in '3 3'"),
        ("3s", "kg m^2", r"'s' .*; use kg m\^2, or another of the same kind"),
        ("3 N/m s", "N s/m", "'N/m s' .* use N s/m"),
        ("10 Hz", "rad/s", "'Hz' .* use rad/s or deg/s or rpm"),
        ("1 N/deg", "N", "'N/deg'"),
        ("3 m(", "m", r"'m\('"),
        ("3 kkg", "kg", "'kkg'"),
        ("3 m^", "m", r"'m\^'"),
        ("3 furlongs", "m", "'furlongs' .* use m or cm or mm"),
        ("3 furlongs", "", "'furlongs' .* use products of kg, m, s, rad, A, "),
        ("3 m", "furlongs", "'m' .* use furlongs$"),
        ("3 " + "m*" * 40 + "m", "m", "'m"),
        ("abc", "m", "'abc' is not a number"),
        ("", "m", "'' is not a number"),
        ("--3", "m", "not a number"),
        ("3,5", "m", "',5'"),
        ("0x10", "m", "'x10'"),
        ("__import__('os')", "m", "not a number"),
        ("1e", "m", "'e'"),
    ],
)
def test_nonsense_is_refused_with_what_would_do(text, unit, told):
    with pytest.raises(MechcError, match=told):
        read_value(text, quantity(unit))


def test_products_of_units_are_those_of_their_factors():
    """Random products, by the factors and dimensions written out here."""
    rng = np.random.default_rng(5)
    known = {
        "mm": (1e-3, "m"), "kg": (1.0, "kg"), "g": (1e-3, "kg"), "s": (1.0, "s"),
        "deg": (math.pi / 180, "rad"),
        "min": (60.0, "s"), "kN": (1e3, "kg m s-2"), "MPa": (1e6, "kg m-1 s-2"), "mA": (1e-3, "A"),
        "V": (1.0, "kg m2 s-3 A-1"), "°": (math.pi / 180, "rad"), "Ω": (1.0, "kg m2 s-3 A-2"),
    }  # fmt: skip
    for _ in range(300):
        names = rng.choice(list(known), rng.integers(1, 5))
        powers = rng.integers(-3, 4, len(names))
        factor, dims, text = 1.0, dict.fromkeys(("kg", "m", "s", "rad", "A"), 0), ""
        for name, power in zip(names, powers.tolist(), strict=True):
            sign = rng.choice(["*", " ", "·", "/"]) if text else ""
            written = f"{name}{rng.choice(['^', '**', ''])}{power}"
            if sign == " " and "/" in text:
                sign = "*"
            text += f"{sign}({written})" if rng.random() < 0.3 else sign + written
            power *= -1 if sign == "/" else 1
            factor *= known[name][0] ** power
            for part in known[name][1].split():
                base = part.rstrip("-0123456789")
                dims[base] += power * int(part[len(base) :] or 1)
        own = " ".join(f"{base}^{power}" for base, power in dims.items()) or "1"
        for unit in (own, ""):
            got = read_value(f"2 {text}", quantity(unit))
            assert got == pytest.approx(2 * factor, rel=1e-13), (text, unit)
        other = own.replace(f"s^{dims['s']}", f"s^{dims['s'] + 1}")
        with pytest.raises(MechcError, match="is not one of its units"):
            read_value(f"2 {text}", quantity(other))


DOORS = {  # a call, and a value with a unit that is none there
    "t_span": lambda run, x: run(x),
    "t_end": lambda run, x: run((0.0, x)),
    "max_step": lambda run, x: run(0.1, max_step=x),
    "first_step": lambda run, x: run(0.1, first_step=x),
}


@pytest.mark.parametrize("door", DOORS)
def test_settings_of_a_run_take_units_of_time(door):
    model = mechc.load("four_bar")
    start = model.assemble({"theta_0": "80 deg"})
    call = DOORS[door]

    def run(*args, **kwargs):
        return model.simulate(*args[:1], start, **kwargs)

    np.testing.assert_array_equal(call(run, "200 ms").y, call(run, 0.2).y)
    with pytest.raises(MechcError, match="'mm' in '1 mm' is not one of its units; use s or ms"):
        call(run, "1 mm")


def test_tolerances_steps_and_levels_have_the_units_of_what_they_are_of():
    model = mechc.load("four_bar")
    start = model.assemble({"theta_0": "80 deg"})
    atol = ["1e-6 deg"] * 3 + ["1e-5 deg/s"] * 3
    sol = model.simulate(0.1, start, atol=atol, events=["theta_0 > 81 deg", "t > 50 ms"])
    np.testing.assert_allclose(np.degrees(sol.policy.atol), [1e-6] * 3 + [1e-5] * 3, rtol=1e-14)
    assert sol.events[1].t == pytest.approx([0.05])
    with pytest.raises(MechcError, match=r"atol of omega_0: 'deg' .* use rad/s"):
        model.simulate(0.1, start, atol="1e-6 deg")
    height = model.simulate(1.0, start, events=["l_0*sin(theta_0) < 98 cm"]).events[0]
    assert np.sin(height.y[0, 0]) == pytest.approx(0.98)
    stepper = model.stepper(start, t="1 s", max_step="1 ms")
    np.testing.assert_array_equal(
        stepper.step("20 ms"), model.stepper(start, max_step=1e-3).step(0.02)
    )
    assert mechc.load("four_bar", fix={"l_3": "350 cm"}).data["fixed"] == {"l_3": 3.5}


def test_infinity_and_nan_are_read_for_the_bounds_to_refuse():
    assert math.isinf(read_value("-inf", quantity("m")))
    assert math.isnan(read_value("nan", quantity("m")))


def test_durations_are_in_seconds():
    assert read_seconds("20") == read_seconds("20s") == read_seconds("2e1 s") == 20
    assert read_seconds("500ms") == 0.5
    assert read_seconds("2min") == read_seconds("120") == read_seconds("2 min") == 120
    with pytest.raises(MechcError, match=r"'m'.*s or ms or min or h"):
        read_seconds("2m")


def test_assignments_come_in_two():
    assert split_assignment(" l_3 = 3.5 m") == ("l_3", "3.5 m")
    assert split_assignment("a=b=c") == ("a", "b=c")
    for text in ("l_3", "=3", "l_3=", " = ", ""):
        with pytest.raises(MechcError, match="NAME=VALUE"):
            split_assignment(text)


def test_the_runtime_has_the_kinds_of_the_compiler():
    """They come with a scene's metadata as texts."""
    assert {kind.name: str(kind) for kind in Kind} == {k.name: str(k) for k in mechc.Kind}


def test_a_kind_decides_where_there_is_one():
    """A coordinate in a unit of its own is an angle where its description says so."""
    quarter = NamedQuantity("x", "grad", "an angle", -math.inf, math.inf, False, Kind.ANGLE)
    assert read_value("90deg", quarter) == pytest.approx(math.pi / 2)
    with pytest.raises(MechcError, match=r"'grad' .* use rad"):
        read_value("90grad", quarter)


@pytest.mark.parametrize("text", ["60", "-13", " 720.5 ", "1e3"])
def test_an_angle_beyond_two_turns_needs_a_unit(text):
    number = float(text)
    readings = f"rad = {math.degrees(number):.6g} deg; for degrees write"
    with pytest.raises(MechcError, match=readings):
        read_value(text, quantity("rad"))
    assert read_value(f"{text.strip()}rad", quantity("rad")) == number
    assert read_value(text, quantity("rad/s")) == number


def test_two_turns_need_none():
    assert read_value("12.5", quantity("rad")) == 12.5


class Measure:
    """A quantity as pint has it: of degrees, or of metres."""

    def __init__(self, magnitude, unit):
        self.magnitude, self._unit = magnitude, unit

    def to(self, unit):
        factors = {("deg", "rad"): math.pi / 180, ("mm", "m"): 1e-3, ("N/m", "N/m"): 1.0,
                   ("ms", "s"): 1e-3}  # fmt: skip
        if (self._unit, unit) not in factors:
            raise TypeError(f"Cannot convert from {self._unit} to {unit}")
        return Measure(self.magnitude * factors[self._unit, unit], unit)

    def to_base_units(self):
        return self.to({"deg": "rad", "mm": "m", "ms": "s"}[self._unit])

    def __array__(self, dtype=None, copy=None):
        """Without the unit, as pint gives it with a warning."""
        return np.array(self.magnitude, dtype)


def test_what_has_no_unit_is_kept():
    given = [1.0, 2, np.arange(3.0), [1, 2], None, print]
    assert all(in_si(each, quantity("m")) is each for each in given)


def test_texts_in_a_list_are_read():
    assert in_si(["5 mm", 2.0, Measure(7, "mm")], quantity("m")) == [0.005, 2.0, 0.007]


def test_quantities_of_pint_are_converted():
    assert in_si(Measure(90, "deg"), quantity("rad")) == pytest.approx(math.pi / 2)
    assert in_si(Measure(np.array([5.0, 6.0]), "mm"), quantity("m")) == pytest.approx([5e-3, 6e-3])
    assert in_si(Measure(5, "mm"), of_unknown_unit("F")) == 0.005
    with pytest.raises(MechcError, match=r"x \[rad\]: Cannot convert from mm to rad"):
        in_si(Measure(5, "mm"), quantity("rad"))


def test_pint_itself():
    pint = pytest.importorskip("pint")
    measure = pint.UnitRegistry().Quantity
    assert in_si(measure(90, "deg"), quantity("rad")) == pytest.approx(math.pi / 2)
    assert in_si(measure(3, "kg*cm^2"), quantity("kg m^2")) == pytest.approx(3e-4)
    with pytest.raises(MechcError, match="Cannot convert"):
        in_si(measure(3, "kg"), quantity("m"))


# -- wherever a value of known kind is given --------------------------------------------------

SIXTY, LENGTH = math.radians(60), 3.5


@pytest.mark.parametrize(
    ("angle", "length"),
    [("60deg", "3500 mm"), (Measure(60, "deg"), Measure(3500, "mm"))],
    ids=["texts", "quantities"],
)
def test_starts_and_parameters_have_units(model, angle, length):
    params, given = {"l_3": LENGTH}, {"l_3": length}
    start = model.assemble({"theta_0": SIXTY}, {"omega_0": 1.0}, params=params)
    units = model.assemble({"theta_0": angle}, {"omega_0": "1 rad/s"}, params=given)
    assert units == pytest.approx(start, rel=1e-14)
    sol = model.simulate(0.1, {"theta_0": angle, "omega_0": 1}, given)
    assert sol.y[0] == pytest.approx(start, rel=1e-14)
    members = mechc.Assembly({"theta_0": [angle, 1.0]}, {"omega_0": 1.0})
    batch = model.simulate_batch(0.1, members, {"l_3": [length, 3.6]})
    assert batch.y0[0] == pytest.approx(start, rel=1e-14)
    swept = model.sweep_positions("theta_0", [angle, "70 deg"], params=given)
    assert swept.q[0, 0] == pytest.approx(SIXTY)


def test_a_reset_has_units():
    event = mechc.Event("theta_0 < 10 deg", reset={"omega_0": "60 rpm"})
    sol = mechc.load("pendulum").simulate(1.0, {"theta_0": "30 deg"}, events=[event])
    (t,) = sol.events[0].t
    assert sol(t + 1e-9)[1] == pytest.approx(2 * math.pi, rel=1e-6)


def test_a_fit_has_units():
    model = mechc.load("pendulum", outputs=("sensitivities",))
    times = np.linspace(0.0, 1.0, 21)
    sol = model.simulate(1.0, {"theta_0": 0.5}, {"l_0": 1.3}, t_eval=times)
    free, measured = {"l_0": ("50 cm", "3 m")}, {"theta_0": "0.5deg"}
    start = {"theta_0": Measure(math.degrees(0.5), "deg")}
    result = model.fit({"t": times, "theta_0": sol["theta_0"]}, free, measured, y0=start)
    assert result["l_0"] == pytest.approx(1.3, rel=1e-6)
    assert result.problem.measured[0].sigma == math.radians(0.5)
    assert result.problem.unknowns[0].upper == 3.0


def test_a_wrong_unit_is_named_with_its_value(model):
    with pytest.raises(MechcError, match="l_3: 'deg' in '3deg' is not one of its units"):
        model.simulate(1.0, {"theta_0": 1.0}, {"l_3": "3deg"})
    with pytest.raises(MechcError, match=r"theta_0: 60 rad = 3437\.75 deg"):
        model.assemble({"theta_0": "60"})


def test_defaults_have_units():
    from sympy import symbols
    from sympy.physics.mechanics import dynamicsymbols

    q, u = dynamicsymbols("q"), dynamicsymbols("u")
    m, k, c = symbols("m k c")
    kane = on_a_line([q], [u], [-k * q - c * u], [m])
    units = {m: "kg", k: "N/m"}
    defaults = {m: "250 g", k: Measure(3.0, "N/m"), c: k / 10}
    model = mechc.compile(kane, defaults=defaults, units=units)
    assert model.defaults == pytest.approx({"m": 0.25, "k": 3.0, "c": 0.3})
    with pytest.raises(MechcError, match="m: 'mm' in '3mm' is not one of its units; use kg or g"):
        mechc.compile(kane, defaults={**defaults, m: "3mm"}, units=units)


MS, MM, DEG = (Measure(np.arange(4.0) * 500.0, unit) for unit in ("ms", "mm", "deg"))
SECONDS, METRES = np.arange(4.0) * 0.5, np.arange(4.0) * 0.5


def signal(times=SECONDS, values=METRES):
    made = mechc.Signal(times, values)
    return np.concatenate([made.times, made.values])


def table(places=SECONDS, values=METRES):
    made = mechc.Table(places, values)
    return made(np.linspace(0.0, 1.5, 7))


def recording(times=SECONDS, values=METRES, unit="m"):
    kind = Kind.LENGTH if unit == "m" else Kind.ANGLE
    meaning = NamedQuantity("x", unit, "x", -math.inf, math.inf, False, kind)
    one = Measured(Quantity("x", "x", (), 0, True, meaning), 1.0)
    found = [
        read_recordings(given, [one])[0] for given in ((times, values), {"t": times, "x": values})
    ]
    return np.concatenate([[*each.t, *each.values[:, 0]] for each in found])


@pytest.mark.parametrize("door", [signal, table, recording], ids=lambda door: door.__name__)
def test_samples_that_are_quantities_are_converted(door):
    """Their units were dropped: 500 ms were 500 s."""
    wanted = door()
    times = MM if door is table else MS
    for given in ((times, METRES), (SECONDS, MM), (times, MM)):
        np.testing.assert_allclose(door(*given), wanted, rtol=1e-15)


@pytest.mark.parametrize("door", [signal, recording], ids=lambda door: door.__name__)
def test_times_have_the_units_of_times(door):
    texts = ["0ms", "500 ms", "1s", "1500ms"]
    np.testing.assert_allclose(door(texts), door(), rtol=1e-15)
    told = xarray.DataArray(SECONDS, attrs={"units": "s"})
    np.testing.assert_array_equal(door(told), door())
    for wrong, words in (
        (MM, "Cannot convert from mm to s"),
        (["0mm", "1mm", "2mm", "3mm"], "'mm' in '0mm' is not one of its units; use s or ms"),
        (np.arange(4).astype("m8[ms]"), r"are in 'timedelta64\[ms\]'"),
        ([np.timedelta64(k, "ms") for k in range(4)], r"are in 'timedelta64\[ms\]'"),
        (np.arange(4).astype("M8[s]"), r"are in 'datetime64\[s\]'"),
        (xarray.DataArray(SECONDS, attrs={"units": "ms"}), "are in 'ms'"),
    ):
        with pytest.raises(MechcError, match=words):
            door(wrong)


def test_arrays_that_are_quantities_are_converted_at_all_doors():
    model = mechc.load("four_bar")
    y = model.assemble({"theta_0": 1.4})
    whole = Measure(1e3 * y, "mm")  # of one unit, as its numbers are in SI
    sol = model.simulate(
        1.0, whole, t_eval=Measure(np.array([0.0, 500.0]), "ms"), max_step=Measure(1.0, "ms")
    )
    np.testing.assert_array_equal(sol.t, [0.0, 0.5])
    assert sol.policy.max_step == 1e-3
    with pytest.raises(MechcError, match=r"atol of theta_0 \[rad\]: Cannot convert from mm to rad"):
        model.simulate(1.0, y, atol=Measure(1.0, "mm"))
    np.testing.assert_allclose(sol(Measure(np.array([500.0]), "ms")), sol.y[1:], rtol=0, atol=1e-12)
    np.testing.assert_allclose(model.energy(whole), model.energy(y), rtol=1e-14)
    np.testing.assert_allclose(recording(SECONDS, DEG, "rad")[4:8], np.radians(DEG.magnitude))
    assert mechc.Sampled(print, Measure(500.0, "ms")).period == 0.5
