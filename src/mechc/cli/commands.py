"""The command ``mechc`` and those it has: run, sweep, fit, show, export and others."""

from __future__ import annotations

import argparse
import importlib.util
import json
import sys
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import mechc
from mechc.cli.arguments import (
    STATE,
    checked_options,
    inputs_of,
    library_name,
    model_of,
    options_of,
    output_folder,
    output_path,
    seconds_of,
    start_state,
    tolerance,
    values_of,
    whole,
)
from mechc.cli.bench import bench
from mechc.cli.export import export_command
from mechc.cli.fit import fit_command
from mechc.cli.open import open_command, open_in_browser
from mechc.cli.options import (
    BAD_INPUT,
    EPILOGUE,
    INTERRUPTED,
    SUITE,
    Parser,
    export_options,
    fit_options,
    force_option,
    run_options,
    scene_options,
    suite_options,
    sweep_options,
    synthesis_options,
    variant_options,
)
from mechc.cli.own_models import is_own
from mechc.cli.show import show_command
from mechc.cli.synthesize import synthesize_command
from mechc.cli.verify import verify_command
from mechc.compilation import cache
from mechc.compilation.library.catalogue import COMPILED_AT_INSTALL, LIBRARY
from mechc.errors import MechcError, MissingPackageError, RunInterrupt
from mechc.files import written_into
from mechc.progress import Notice, ProgressBar
from mechc.results.summary import json_summary, summary
from mechc.results.untrusted import printable

FAILED = 1


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; its exit code.

    0, 1 if a run ended early, 2 for invalid input, 130 after Ctrl-C: with what was computed until
    then printed and written.
    """
    try:
        chosen = _parser().parse_args(arguments)
        command: Callable[[argparse.Namespace], int] = chosen.command
        with warnings.catch_warnings():
            warnings.showwarning = _tell_warning
            return command(chosen)
    except BrokenPipeError:
        sys.stderr.close()
        return FAILED
    except KeyboardInterrupt:
        print("mechc: interrupted", file=sys.stderr)
        return INTERRUPTED
    except (MechcError, ValueError, OSError) as error:
        print(f"mechc: {_in_words(error)}", file=sys.stderr)
        return BAD_INPUT


def _tell_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    print(f"mechc: {printable(str(message))}", file=sys.stderr)


def _in_words(error: Exception) -> str:
    """Lines without control characters, which names of users may contain."""
    told = str(error)
    if isinstance(error, OSError) and error.filename:
        told = f"{error.filename}: {error.strerror}"
    return "\n".join(map(printable, told.split("\n")))


# -- the parser -------------------------------------------------------------------------------


def _parser() -> argparse.ArgumentParser:
    from mechc import __version__

    parser = Parser(
        prog="mechc",
        description="Mechanisms compiled to C, simulated fast and right.",
        epilog=EPILOGUE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"mechc {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    _add(commands, "list", "the library's mechanisms", _list)
    run_options(_add(commands, "run", "simulate, draw, animate, save", _run))
    sweep_options(_add(commands, "sweep", "many runs, a map, data in Zarr", _sweep))
    fit_options(_add(commands, "fit", "values from recorded motions", fit_command))
    about = "parameters of linkages for points, angles or poses"
    synthesis_options(_add(commands, "synthesize", about, synthesize_command))
    undamaged = "whether saved data are undamaged; a check saved with a motion is made again"
    saved = _add(commands, "verify", undamaged, verify_command)
    saved.add_argument(
        "path", metavar="PATH", help="a saved solution, a batch, or the folder of a run or sweep"
    )
    seen = _add(commands, "open", "the picture in space of a saved motion", open_command)
    seen.add_argument("path", metavar="FILE", help="a saved solution, .nc, or the folder of a run")
    seen.add_argument(
        "--view", metavar="OUT", help="write OUT.html, .png, .gif or .mp4 [FILE.html, and open it]"
    )
    force_option(seen)
    show = _add(
        commands,
        "show",
        "facts about a mechanism, a verdict on a robot's file; its derivation as a page",
        show_command,
    )
    scene_options(show)
    show.add_argument("--latex", action="store_true", help="with --out: LaTeX instead of HTML")
    show.add_argument("--out", metavar="FILE", help="write the derivation to this page")
    force_option(show)
    handed_on = "for other programs: C files, WebAssembly, a functional mock-up unit"
    export_options(_add(commands, "export", handed_on, export_command))
    emit = _add(commands, "emit", "the generated C", _emit)
    variant_options(emit)
    emit.add_argument("--out", metavar="DIR", help="write all files there [print the program]")
    force_option(emit)
    stored = _add(commands, "cache", "scenes compiled on demand", _cache)
    stored.add_argument("--clear", action="store_true", help="remove them")
    _add(commands, "doctor", "check compiler, cache and packages", _doctor)
    suite = suite_options(commands.add_parser("bench", **SUITE))
    suite.set_defaults(command=lambda chosen: bench(chosen.options))
    return parser


def _add(
    commands: Any, name: str, about: str, command: Callable[[argparse.Namespace], int]
) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = commands.add_parser(name, help=about, description=about)
    parser.set_defaults(command=command)
    return parser


# -- commands ---------------------------------------------------------------------------------


def _list(_: argparse.Namespace) -> int:
    names, titles = (max(map(len, c)) for c in (LIBRARY, (e.title for e in LIBRARY.values())))
    for name, entry in LIBRARY.items():
        when = "install" if name in COMPILED_AT_INSTALL else "its first use"
        print(f"{name:{names}}  {entry.title:{titles}}  compiled at {when}")
    return 0


def _run(chosen: argparse.Namespace) -> int:
    t_end, rtol = seconds_of(chosen), tolerance(chosen)
    model = model_of(chosen)
    model = model.with_inputs(inputs_of(model, chosen))
    params = values_of(model, chosen.parameters, model.parameters, "parameter")
    state = start_state(model, chosen, params)
    if chosen.view is not None:
        output_path(chosen, chosen.view, "")
    with output_folder(chosen) as folder, ProgressBar(f"simulating {model.name}") as bar:
        try:
            sol = model.simulate(
                t_end, state, params, rtol=rtol, method=chosen.method, progress=bar.update
            )
        except RunInterrupt as interrupt:
            sol = interrupt.solution
    checked = sol.check() if chosen.check else None
    if chosen.json:
        told = {} if checked is None else {"check": checked.to_dict()}
        print(json.dumps(json_summary(sol) | told))
    else:
        print(f"{model.title}, 0 to {t_end:g} s\n{summary(sol)}")
        if checked is not None:
            print(checked)
    if folder is not None:
        with written_into(folder):
            page = _write(sol, folder, in_space=chosen.open, quiet=chosen.json)
        if chosen.open:
            open_in_browser(page)
    if chosen.view is not None:
        with Notice("drawing the view ..."):
            saved = sol.view().save(chosen.view)
        if not chosen.json:
            print(f"written: {saved.resolve()}")
    if sol.status.code == "interrupted":
        return INTERRUPTED
    return 0 if sol.status.ok and (checked is None or checked.ok) else FAILED


def _sweep(chosen: argparse.Namespace) -> int:
    from mechc.batch.stored.store import holds_batch, is_unfinished
    from mechc.batch.sweeps.sweep import plan, read_variation

    t_end, rtol = seconds_of(chosen), tolerance(chosen)
    model = model_of(chosen)
    model = model.with_inputs(inputs_of(model, chosen))
    count = None if chosen.count is None else whole("--count", chosen.count)
    threads = None if chosen.threads is None else whole("--threads", chosen.threads)
    seed = whole("--seed", chosen.seed)
    variations = [read_variation(model, text) for text in chosen.vary]
    plan(variations, chosen.sample, count, seed)  # refuses before a folder is made
    with_zarr = importlib.util.find_spec("zarr") is not None
    goes_on = holds_batch if chosen.out else is_unfinished
    with output_folder(chosen, "mechc_sweep", lambda path: goes_on(path / "batch")) as folder:
        stored = folder is not None and with_zarr
        try:
            sweep = model.sweep(
                t_end,
                chosen.vary,
                values_of(model, chosen.parameters, model.parameters, "parameter"),
                sample=chosen.sample,
                count=count,
                seed=seed,
                start=values_of(model, chosen.start, (*model.coordinates, *model.speeds), STATE),
                guess=values_of(model, chosen.guess, model.coordinates, "coordinate"),
                reduce=chosen.reduce,
                rtol=rtol,
                method=chosen.method,
                threads=threads,
                out=folder / "batch" if folder is not None and stored else None,
            )
        except RunInterrupt as interrupt:
            sweep = interrupt.sweep
    print(json.dumps(sweep.to_json()) if chosen.json else f"{model.title}\n{sweep}")
    if folder is not None:
        with Notice("drawing ..."), written_into(folder):
            written = sweep.save_maps(folder)
        if not chosen.json:
            data = "batch (mechc.open reads it)" if stored else "no data (pip install zarr)"
            print(f"\nwritten into {folder.resolve()}: {data}, ", end="")
            print(", ".join(path.name for path in written))
    return 0 if sweep.batch.complete else INTERRUPTED


def _write(sol: mechc.Solution, folder: Path, *, in_space: bool, quiet: bool) -> Path:
    """Data, pictures and the page that moves, which is returned."""
    import numpy as np

    from mechc.results.animation import animate
    from mechc.results.figures import save_all

    sol.save(folder / "solution.csv")
    sol.save(folder / "solution.nc")
    with Notice("drawing ..."), np.errstate(over="ignore", invalid="ignore"):
        animate(sol).save(folder / "animation.html")
        save_all(sol, folder)
        page = folder / "animation.html"
        if in_space:
            try:
                page = sol.view().save(folder / "view.html")
            except MissingPackageError as missing:  # without three.js that page serves
                print(f"mechc: {missing}", file=sys.stderr)
    if not quiet:
        print(f"\nwritten into {folder.resolve()}:")
        print(f"  {'  '.join(sorted(path.name for path in folder.iterdir()))}")
        print(f"open {page.resolve()} in a browser to see it move")
    return page


def _emit(chosen: argparse.Namespace) -> int:
    from mechc.compilation.exports.standalone import described
    from mechc.compilation.library.library import described_as_asked, generated_texts

    if is_own(chosen.name):
        asked = described(model_of(chosen).system)
    else:
        options = checked_options(library_name(chosen.name), options_of(chosen.options))
        asked = described_as_asked(chosen.name, options, {})
    texts = generated_texts(*asked)
    if not chosen.out:
        print(texts["scene_program.h"])
        return 0
    folder = output_path(chosen, chosen.out, "")
    with written_into(folder):
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in texts.items():
            (folder / name).write_text(text, "utf-8")
            print(folder / name)
    return 0


def _cache(chosen: argparse.Namespace) -> int:
    if chosen.clear:
        print(f"removed {cache.clear()} compiled scenes from {cache.cache_folder()}")
        return 0
    found = cache.scenes()
    print(f"{cache.cache_folder()}: {len(found)} compiled scenes")
    for key, folders in found.items():
        size = sum(path.stat().st_size for folder in folders for path in folder.iterdir())
        print(f"  {key[:16]}  {size / 1024:.0f} KiB")
    return 0


def _doctor(_: argparse.Namespace) -> int:
    from mechc.cli.doctor import examine, written

    checks = examine()
    print(written(checks))
    return 0 if all(well for _, well, _ in checks) else FAILED
