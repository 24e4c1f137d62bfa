"""The command in this process: its object of JSON, or the line in which it complains."""

import json
import re

from mechc.cli.commands import main

# Lines of `mechc.progress`, which a slow machine makes: "drawing", "TITLE: 20%", ...
PROGRESS = re.compile(r"(compil|drawing|deriving|reading|writing|looking for)|[^:]+: \d+%")


def run_json(capsys, *arguments):
    assert main([*arguments, "--json"]) == 0
    said = capsys.readouterr()
    tells_only_what_takes_long(said.err)
    assert said.out.count("\n") == 1
    return json.loads(said.out)


def without_progress(text):
    return "".join(line for line in text.splitlines(True) if not PROGRESS.match(line))


def tells_only_what_takes_long(text):
    assert without_progress(text) == ""


def complaint(capsys, *arguments):
    """The one line that the command complains in."""
    try:
        code = main(list(arguments))
    except SystemExit as end:
        code = end.code
    said = capsys.readouterr()
    told = without_progress(said.err)
    assert code == 2
    assert said.out == ""
    assert told.startswith("mechc: ")
    assert told.count("\n") == 1
    assert "Traceback" not in told
    return told
