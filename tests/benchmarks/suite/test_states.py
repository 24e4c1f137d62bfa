"""Last states to the last bit: one that differs is named and is the exit code."""

import json

import mechc
from benchmarks.suite import states


def test_the_states_of_before_are_found_again_and_another_bit_is_named(tmp_path, capsys):
    file = tmp_path / "before.json"
    assert states.main(["--out", str(file), "four_bar"]) == 0
    before = json.loads(file.read_text("utf-8"))
    assert set(before) == {f"four_bar {what}" for what in ("start", *states.METHODS)}
    assert float.fromhex(before["four_bar dop853"][2]) == states.T_END
    assert states.main(["--against", str(file), "four_bar"]) == 0
    one = float.fromhex(before["four_bar auto"][-1])
    before["four_bar auto"][-1] = (one * (1 + 2**-52)).hex()
    file.write_text(json.dumps(before))
    capsys.readouterr()
    assert states.main(["--against", str(file), "four_bar"]) == 1
    assert "5 equal, 1 differ: four_bar auto" in capsys.readouterr().out


def test_runs_begin_at_the_earlier_start_and_a_start_assembled_otherwise_is_named():
    model = mechc.load("four_bar")
    other = [x.hex() for x in model.assemble({"theta_0": 1.0}).tolist()]
    found = states.last_states(["four_bar"], {"four_bar start": other})
    ours = states.last_states(["four_bar"], {})
    assert found["four_bar start"] == ours["four_bar start"]
    assert "four_bar start" in states.differing(found, {"four_bar start": other})
    assert not set(states.differing(found, ours)) ^ {f"four_bar {m}" for m in states.METHODS}
