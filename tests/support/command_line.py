"""The command in this process: its object of JSON, or the line in which it complains."""

import json
import re

from mechc.cli.commands import main


def run_json(capsys, *arguments):
    assert main([*arguments, "--json"]) == 0
    said = capsys.readouterr()
    tells_only_what_takes_long(said.err)
    assert said.out.count("\n") == 1
    return json.loads(said.out)


def tells_only_what_takes_long(text):
    """Lines of `mechc.progress`, which a slow machine makes: "drawing", "TITLE: 20%", ..."""
    told = re.compile(r"compil|drawing|[^:]+: \d+%")
    assert [line for line in text.splitlines() if not told.match(line)] == []


def complaint(capsys, *arguments):
    """The one line that the command complains in."""
    try:
        code = main(list(arguments))
    except SystemExit as end:
        code = end.code
    said = capsys.readouterr()
    assert code == 2
    assert said.out == ""
    assert said.err.startswith("mechc: ")
    assert said.err.count("\n") == 1
    assert "Traceback" not in said.err
    return said.err
