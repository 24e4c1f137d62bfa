"""The scripts of the suite with their options and limits, and other commands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module

Options = tuple[str, ...]


@dataclass(frozen=True)
class Script:
    """The question of a script, and how it is run.

    Attributes
    ----------
    module
        Has ``main(arguments)``, which gives the exit code and writes ``NAME.json``.
    quick, full, smoke
        Its options in a run of this size; None where it is left out.  A quick run that names the
        script takes the options of the full one then.
    limits
        Seconds that a quick and a full run of it may take at most.
    """

    asks: str
    module: str
    quick: Options | None = None
    full: Options | None = None
    smoke: Options | None = None
    limits: tuple[float, float] = (600.0, 1800.0)


SCRIPTS = {
    "work_precision": Script(
        "run time against achieved error, all problems, all methods, all peers",
        "suite.work_precision",
        ("--quick",), (), ("--quick", "--problem", "pendulum_1", "--only"), (900.0, 3600.0),
    ),
    "stress": Script(
        "whether every hard case is right, refused, or ended with a status", "stability.stress",
        (), ("--full",), ("--family", "dead points", "bad arguments"), (600.0, 3600.0),
    ),
    "growth": Script(
        "costs of more links", "costs.growth",
        ("--quick",), (), ("--most", "1", "--scenes", "planar"),
    ),
    "batch": Script(
        "many trajectories: rates, threads, streaming", "suite.batch",
        ("--only", "trajectories", "--members", "1000"), (), ("--only", "rhs"),
    ),
    "costs": Script(
        "installation, start, calls, first values, memory, instructions", "costs.costs",
        ("--quick",), ("--full",), None,
    ),
    "scenes": Script(
        "operations, bytes and seconds of compiled scenes", "costs.scenes", None, (), None
    ),
}  # fmt: skip

COMMANDS = {  # not part of the suite: by their names only
    "fit": Script("how often intervals of fits hold the truth, and milliseconds",
                   "costs.fitting"),
    "fuzz": Script("short motions of random linkages: is any wrong without a word?",
                    "fuzz.command"),
    "drawn": Script("scenes drawn from a grammar: do all methods and doors agree?",
                     "drawn.command"),
    "closing": Script("microseconds that it takes to close loops", "costs.closing"),
    "optimal": Script("optimal motions with known costs: errors, iterations, seconds",
                       "formulations.optimal"),
    "crossing": Script("the picture of the README: a four-bar through its change points",
                        "report.crossing"),
    "report": Script("the report of figures measured before", "report.command"),
    "references": Script("exact motions of data/, computed again", "references.command"),
    "check": Script("error estimates of sol.check() over the true errors", "suite.checks"),
    "default": Script("the default's time over the best method's, runs and batches",
                       "suite.default"),
    "derivatives": Script("errors of derivatives of motions against 30 digits",
                           "references.sensitivities.derivatives"),
    "sensitivities": Script("run times with derivatives over those without",
                             "costs.sensitivities"),
    "states": Script("last states of the library to the last bit, before and now",
                      "suite.states"),
    "thresholds": Script("what half and twice of each constant of the C runtime do",
                          "thresholds.command"),
    "wait": Script("seconds from compile to the end of the first simulate",
                    "costs.first"),
    "friction": Script("steps with dry friction over plain ones; events in three ways",
                        "costs.friction"),
    "elsewhere": Script("what other tools say of motions that are known exactly",
                         "peers.elsewhere"),
    "robots": Script("robots in URDF: differences from Pinocchio, and times", "suite.robots"),
    "stepper": Script("the latency of steps in a loop with the world", "costs.stepping"),
}  # fmt: skip


def call(name: str, arguments: Sequence[str]) -> int:
    """Run a script or command in this process; its exit code."""
    module = (SCRIPTS | COMMANDS)[name].module
    code: int = import_module(f"..{module}", __package__).main(arguments)
    return code
