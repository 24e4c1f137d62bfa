"""A comparison goes on without a peer that hangs or crashes."""

import sys
import textwrap

import pytest

from benchmarks.suite import apart
from benchmarks.timing import cases

HANGS, CRASHES = "while True: pass", "os._exit(3)"


@pytest.mark.parametrize(("does", "told"), [(HANGS, "did not finish"), (CRASHES, "exit code 3")])
def test_a_peer_that_hangs_or_crashes_is_named_and_the_others_go_on(
    monkeypatch, tmp_path, does, told
):
    """The process is started again without it."""
    script = tmp_path / "script.py"
    script.write_text(
        textwrap.dedent(f"""\
        import json, os, sys
        request = json.load(open(sys.argv[1]))
        if "bad" in request["peers"]:
            open(request["working"], "w").write("bad")
            {does}
        open(request["result"], "w").write(json.dumps({{"skipped": {{}}, "of": request["peers"]}}))
    """)
    )
    monkeypatch.setattr(apart, "COMPARE", [sys.executable, str(script)])
    effort = cases.Effort()
    entry = apart.compare_apart("x", ("good", "bad"), (1e-3,), effort, quick=True, patience=1.0)
    assert entry["of"] == ["good"]
    assert told in entry["skipped"]["bad"]
