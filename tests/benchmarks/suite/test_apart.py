"""A comparison goes on without a peer that hangs or crashes."""

import sys
import textwrap
from importlib import import_module

import pytest

from benchmarks.suite import apart
from benchmarks.timing import cases

HANGS, CRASHES = "while True: pass", "os._exit(3)"


@pytest.mark.slow(cases=99)
@pytest.mark.parametrize(("does", "told"), [(HANGS, "did not finish"), (CRASHES, "exit code 3")])
def test_a_peer_that_hangs_or_crashes_is_named_and_the_others_go_on(
    monkeypatch, tmp_path, does, told
):
    """The process is started again without it."""
    script = tmp_path / "does_the_work.py"
    script.write_text(
        textwrap.dedent(f"""\
        import json, os

        def work(request):
            if "bad" in request.peers:
                request.working.write_text("bad")
                {does}
            request.result.write_text(json.dumps({{"skipped": {{}}, "of": request.peers}}))
    """)
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(apart, "write_comparison", import_module("does_the_work").work)
    effort = cases.Effort()
    entry = apart.compare_apart("x", ("good", "bad"), (1e-3,), effort, quick=True, patience=1.0)
    monkeypatch.delitem(sys.modules, "does_the_work")
    assert entry["of"] == ["good"]
    assert told in entry["skipped"]["bad"]
