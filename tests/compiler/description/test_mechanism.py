"""A mechanism as a whole."""

from mechc_codegen.library.catalogue import shipped_mechanism


def test_a_mechanism_shows_itself_in_a_line():
    assert repr(shipped_mechanism("four_bar")) == (
        "<mechc.Mechanism four_bar: 3 coordinates, 3 speeds, 3 bodies, 4 joints, 2 constraints, "
        "11 parameters>"
    )
    single = repr(shipped_mechanism("pendulum"))
    assert "1 coordinate, 1 speed, 1 body, 0 joints, 0 constraints" in single
