"""The command ``mechc``: list, show, run, sweep, emit, cache, doctor."""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import sys
import time
import webbrowser
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from mechc import cache
from mechc.errors import MechcError, UnknownNameError
from mechc.load import load, mechanisms
from mechc.model import Model
from mechc.progress import ProgressBar
from mechc.report import json_summary, summary
from mechc.solution import Solution
from mechc.typed import read_seconds, read_value, split_assignment

FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130
STATE = "coordinate or speed"
EPILOGUE = """\
examples:
  mechc run four_bar                          the reference scene: 85 deg, at rest, 20 s
  mechc run four_bar --set l_3=3.5 --start theta_0=60deg --start omega_0=30deg/s
  mechc run four_bar --with friction --set c_0=0.5 --json
  mechc sweep four_bar --vary l_3=3.4:4.6:61 --vary theta_0=60deg:120deg:31 --t-end 5
  mechc show four_bar --set l_3=3.5           Grashof class, parameters, options
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; the exit code: 0, 1 if a run ended early, 2 for bad input."""
    try:
        chosen = _parser().parse_args(arguments)
        command: Callable[[argparse.Namespace], int] = chosen.command
        return command(chosen)
    except BrokenPipeError:
        sys.stderr.close()
        return FAILED
    except KeyboardInterrupt:
        print("mechc: interrupted", file=sys.stderr)
        return INTERRUPTED
    except (MechcError, ValueError, OSError) as error:
        print(f"mechc: {_one_line(error)}", file=sys.stderr)
        return BAD_INPUT


def _one_line(error: Exception) -> str:
    if isinstance(error, OSError) and error.filename:
        return f"{error.filename}: {error.strerror}"
    return str(error)


# -- what can be typed ------------------------------------------------------------------------


class _Parser(argparse.ArgumentParser):
    """An argparse parser whose complaints are one line."""

    def error(self, message: str) -> Any:
        self.exit(BAD_INPUT, f"mechc: {message} (mechc {self._about()}--help says more)\n")

    def _about(self) -> str:
        words = self.prog.split()[1:]
        return "".join(f"{word} " for word in words)


def _parser() -> argparse.ArgumentParser:
    from mechc import __version__

    parser = _Parser(
        prog="mechc",
        description="Mechanisms compiled to C, simulated fast and right.",
        epilog=EPILOGUE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"mechc {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    _add(commands, "list", "the shipped mechanisms", _list)
    _run_options(_add(commands, "run", "simulate, draw, animate, save", _run))
    _sweep_options(_add(commands, "sweep", "many runs, a map, data in Zarr", _sweep))
    show = _add(commands, "show", "what a mechanism is; its derivation as a page", _show)
    _scene_options(show)
    show.add_argument("--latex", action="store_true", help="with --out: LaTeX instead of HTML")
    show.add_argument("--out", metavar="FILE", help="write the derivation as a page there")
    emit = _add(commands, "emit", "the generated C", _emit)
    _variant_options(emit)
    emit.add_argument("--out", metavar="DIR", help="write all files there [print the program]")
    stored = _add(commands, "cache", "scenes compiled on demand", _cache)
    stored.add_argument("--clear", action="store_true", help="remove them")
    _add(commands, "doctor", "check compiler, cache and packages", _doctor)
    return parser


def _add(
    commands: Any, name: str, about: str, command: Callable[[argparse.Namespace], int]
) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = commands.add_parser(name, help=about, description=about)
    parser.set_defaults(command=command)
    return parser


def _variant_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", metavar="NAME", help="a mechanism of `mechc list`")
    parser.add_argument(
        "--with",
        dest="options",
        metavar="OPTION[=VALUE]",
        action="append",
        default=[],
        help="ask for more than the default scene, e.g. friction or crank_torque='2*sin(t)'",
    )


def _scene_options(parser: argparse.ArgumentParser) -> None:
    _variant_options(parser)
    parser.add_argument(
        "--set",
        dest="parameters",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        help="a parameter, in SI units or with its unit: l_3=3.5, l_3=3500mm",
    )


def _run_options(parser: argparse.ArgumentParser) -> None:
    _start_options(parser)
    parser.add_argument("--open", action="store_true", help="open the animation in a browser")


def _sweep_options(parser: argparse.ArgumentParser) -> None:
    _start_options(parser)
    parser.add_argument(
        "--vary",
        metavar="NAME=LOW:HIGH[:COUNT]",
        action="append",
        default=[],
        help="what varies, from where to where; in a grid with how many values",
    )
    parser.add_argument("--sample", default="grid", help="grid, random, sobol or lhs [grid]")
    parser.add_argument("--count", metavar="N", help="members, where they are drawn [1024]")
    parser.add_argument("--seed", default="0", metavar="N", help="of what is drawn [0]")
    parser.add_argument(
        "--reduce",
        metavar="REDUCTION",
        action="append",
        default=[],
        help="what is mapped, e.g. 'max(theta_2)' or 'first(theta_0 > 180deg)'; may be repeated",
    )
    parser.add_argument("--threads", metavar="N", help="[all cores]")


def _start_options(parser: argparse.ArgumentParser) -> None:
    _scene_options(parser)
    parser.add_argument(
        "--start",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        help="a coordinate or speed at the start: theta_0=85deg, omega_0=30deg/s",
    )
    parser.add_argument(
        "--guess",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        help="a coordinate near which to assemble, where there is a choice",
    )
    parser.add_argument("--t-end", default="20", metavar="TIME", help="20, 20s, 500ms, 2min [20 s]")
    parser.add_argument("--rtol", default="1e-9", metavar="TOL", help="tolerated error [1e-9]")
    parser.add_argument(
        "--method", default="auto", help="auto, dopri5, dop853, gauss8 or radau5 [auto]"
    )
    parser.add_argument("--out", metavar="DIR", help="where pictures and data go [mechc_NAME]")
    parser.add_argument(
        "--json", action="store_true", help="print one JSON object; write only with --out"
    )


# -- commands ---------------------------------------------------------------------------------


def _list(_: argparse.Namespace) -> int:
    for name in mechanisms():
        print(f"{name}  {load(name).title}")
    return 0


def _run(chosen: argparse.Namespace) -> int:
    model = _model(chosen)
    t_end = _seconds(chosen)
    rtol = _number("--rtol", chosen.rtol)
    params = _values(model, chosen.parameters, model.parameters, "parameter")
    state = _start_state(model, chosen, params)
    folder = _folder(chosen)
    with ProgressBar(f"simulating {model.name}") as bar:
        sol = model.simulate(
            t_end, state, params, rtol=rtol, method=chosen.method, progress=bar.update
        )
    if chosen.json:
        print(json.dumps(json_summary(sol)))
    else:
        print(f"{model.title}, 0 to {t_end:g} s\n{summary(sol)}")
    if folder is not None:
        _write(sol, folder, quiet=chosen.json)
        if chosen.open:
            _open_in_browser(folder / "animation.html")
    if sol.status.code == "interrupted":
        return INTERRUPTED
    return 0 if sol.status.ok else FAILED


def _sweep(chosen: argparse.Namespace) -> int:
    from mechc.sweep import plan, read_variation, run_sweep, sweep_json, sweep_summary
    from mechc.sweep_plot import save_maps

    model = _model(chosen)
    count = None if chosen.count is None else _whole("--count", chosen.count)
    threads = None if chosen.threads is None else _whole("--threads", chosen.threads)
    variations = [read_variation(model, text) for text in chosen.vary]
    members = plan(variations, chosen.sample, count, _whole("--seed", chosen.seed))
    folder = _folder(chosen, "mechc_sweep")
    stored = folder is not None and importlib.util.find_spec("zarr") is not None
    started = time.perf_counter()
    batch = run_sweep(
        model,
        members,
        _seconds(chosen),
        chosen.reduce or [f"max({model.coordinates[-1]})"],
        params=_values(model, chosen.parameters, model.parameters, "parameter"),
        start=_values(model, chosen.start, (*model.coordinates, *model.speeds), STATE),
        guess=_values(model, chosen.guess, model.coordinates, "coordinate"),
        rtol=_number("--rtol", chosen.rtol),
        method=chosen.method,
        threads=threads,
        out=folder / "batch" if folder is not None and stored else None,
    )
    seconds = time.perf_counter() - started
    if chosen.json:
        print(json.dumps(sweep_json(batch, members, seconds)))
    else:
        print(f"{model.title}\n{sweep_summary(batch, members, seconds)}")
    if folder is not None:
        with ProgressBar("drawing"):
            written = save_maps(batch, members, folder)
        if not chosen.json:
            data = "batch (mechc.open reads it)" if stored else "no data (pip install zarr)"
            print(f"\nwritten into {folder.resolve()}: {data}, ", end="")
            print(", ".join(path.name for path in written))
    return 0 if batch.complete else INTERRUPTED


def _seconds(chosen: argparse.Namespace) -> float:
    t_end = read_seconds(chosen.t_end)
    if not t_end > 0:
        raise MechcError(f"--t-end must be positive, not {chosen.t_end}")
    return t_end


def _start_state(model: Model, chosen: argparse.Namespace, params: dict[str, float]) -> Any:
    state_names = (*model.coordinates, *model.speeds)
    start = _values(model, chosen.start, state_names, STATE)
    guess = _values(model, chosen.guess, model.coordinates, "coordinate")
    coordinates = {n: v for n, v in start.items() if n in model.coordinates}
    if not coordinates and not guess:
        coordinates = {n: v for n, v in model.start.items() if n in model.coordinates}
    speeds = {n: v for n, v in start.items() if n in model.speeds}
    if not speeds:
        speeds = {n: v for n, v in model.start.items() if n in model.speeds}
    return model.assemble(coordinates, speeds, guess or None, params)


def _folder(chosen: argparse.Namespace, prefix: str = "mechc") -> Path | None:
    """The output folder, made now so that a bad one is known before the work is done."""
    if chosen.json and not chosen.out:
        return None
    folder = Path(chosen.out or f"{prefix}_{chosen.name}")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / ".mechc-probe"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise MechcError(f"cannot write into {folder}: {error.strerror}") from None
    return folder


def _write(sol: Solution, folder: Path, *, quiet: bool) -> None:
    from mechc.animate import write_animation
    from mechc.plot import save_all

    sol.save(folder / "solution.csv")
    sol.save(folder / "solution.nc")
    write_animation(sol, folder / "animation.html")
    with ProgressBar("drawing"):
        save_all(sol, folder)
    if not quiet:
        print(f"\nwritten into {folder.resolve()}:")
        print(f"  {'  '.join(sorted(path.name for path in folder.iterdir()))}")
        print(f"open {(folder / 'animation.html').resolve()} in a browser to see it move")


def _open_in_browser(path: Path) -> None:
    """On a desktop; elsewhere the path printed has to do."""
    desktop = sys.platform == "darwin" or "DISPLAY" in os.environ or "WAYLAND_DISPLAY" in os.environ
    if desktop:
        webbrowser.open(path.resolve().as_uri())


def _show(chosen: argparse.Namespace) -> int:
    from mechc.jit import derivation_notes, derivation_page, shipped_options

    model = load(_known(chosen.name))
    options = _options(chosen.options)
    if options:
        model = load(chosen.name, **options)
    params = _values(model, chosen.parameters, model.parameters, "parameter")
    values = dict(zip(model.parameters, model._parameters.resolve(params).tolist(), strict=True))
    print(f"{model.title}\n")
    for name, quantity in model.quantities.items():
        value = f"{values[name]:g} {quantity.unit}" if name in values else quantity.unit
        print(f"  {name:10} {value:18} {quantity.description}")
    print()
    for label, sentence in derivation_notes(chosen.name, values):
        print(f"{label}: {sentence}.")
    print("\nmore on request (--with NAME):")
    for name, about in shipped_options(chosen.name).items():
        print(f"  {name:15} {about}")
    if not chosen.out:
        ending = "tex" if chosen.latex else "html"
        print(f"\nits derivation, as a page: mechc show {chosen.name} --out {chosen.name}.{ending}")
        return 0
    page = Path(chosen.out)
    page.write_text(derivation_page(chosen.name, options, values, chosen.latex), "utf-8")
    print(f"\nthe derivation is in {page.resolve()}")
    return 0


def _emit(chosen: argparse.Namespace) -> int:
    from mechc.jit import generated_texts

    texts = generated_texts(_known(chosen.name), _options(chosen.options))
    if not chosen.out:
        print(texts["scene_program.h"])
        return 0
    folder = Path(chosen.out)
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        (folder / name).write_text(text, "utf-8")
        print(folder / name)
    return 0


def _cache(chosen: argparse.Namespace) -> int:
    if chosen.clear:
        print(f"removed {cache.clear()} compiled scenes from {cache.cache_folder()}")
        return 0
    found = cache.entries()
    print(f"{cache.cache_folder()}: {len(found)} compiled scenes")
    for folder in found:
        size = sum(path.stat().st_size for path in folder.iterdir())
        print(f"  {folder.name[:16]}  {size / 1024:.0f} KiB")
    return 0


def _doctor(_: argparse.Namespace) -> int:
    from mechc.doctor import examine, written

    checks = examine()
    print(written(checks))
    return 0 if all(well for _, well, _ in checks) else FAILED


# -- reading ----------------------------------------------------------------------------------


def _known(name: str) -> str:
    if name not in mechanisms():
        raise UnknownNameError("mechanism", name, mechanisms())
    return name


def _model(chosen: argparse.Namespace) -> Model:
    return load(_known(chosen.name), **_options(chosen.options))


def _options(typed: Sequence[str]) -> dict[str, Any]:
    """``friction`` is on; ``crank_torque=2*t`` has a value."""
    return {
        name.strip(): value.strip() if sign else True
        for name, sign, value in (text.partition("=") for text in typed)
    }


def _values(
    model: Model, typed: Sequence[str], known: Sequence[str], kind: str
) -> dict[str, float]:
    values = {}
    for text in typed:
        name, value = split_assignment(text)
        if name not in known:
            raise UnknownNameError(kind, name, known)
        if name in values:
            raise MechcError(f"{name} is given twice")
        values[name] = read_value(value, model.quantities[name])
    return values


def _number(option: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise MechcError(f"{option} must be a number, not {text!r}") from None


def _whole(option: str, text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise MechcError(f"{option} must be a whole number, not {text!r}") from None
