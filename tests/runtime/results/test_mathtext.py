"""Names in pictures are typeset; what is no name of letters and indices stays plain text."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.mathtext import MathTextParser

from mechc.results.mathtext import typeset

SHOWN = {
    "theta_0": r"$\theta_{0}$",
    "omega12": r"$\omega_{12}$",
    "l_AB": r"$l_{\mathrm{AB}}$",
    "q_slew_joint": r"$q_{\mathrm{slew},\mathrm{joint}}$",
    "theta_0_dot": r"$\dot{\theta}_{0}$",
    "q_dot": r"$\dot{q}$",
    "k_theta": r"$k_{\theta}$",
    "Omega": r"$\Omega$",
    "q_left_bar": r"$q_{\mathrm{left},\mathrm{bar}}$",
    "lamda": r"$\lambda$",
    "slider": r"$\mathrm{slider}$",
    "x y": "x y",
    "cost$": r"cost\$",
    "_": "_",
    r"\\frac": r"\\frac",
}


@pytest.mark.parametrize("name", SHOWN)
def test_names_are_typeset_as_written(name: str) -> None:
    assert typeset(name) == SHOWN[name]


@given(name=st.text(max_size=40) | st.from_regex(r"[a-zA-Z]{1,7}[0-9]{0,3}(_[a-z0-9]{1,5}){0,3}"))
def test_every_name_can_be_drawn(name: str) -> None:
    MathTextParser("path").parse(typeset(name).replace("\n", " "))
