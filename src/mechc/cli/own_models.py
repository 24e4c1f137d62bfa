"""Models in files of users: FILE.py:NAME, robots in FILE.urdf and FILE.sdf, MuJoCo's FILE.xml."""

from __future__ import annotations

import ast
import importlib.util
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import mechc
from mechc.errors import MechcError

# Functions and classes that make what can be simulated.
MAKERS = ("compile", "load", "Mechanism", "from_equations", "from_joints", "from_mjcf",
          "from_sdf", "from_urdf", "KanesMethod", "LagrangesMethod", "System")  # fmt: skip
READERS = {".urdf": "from_urdf", ".sdf": "from_sdf", ".xml": "from_mjcf"}


def is_own(name: str) -> bool:
    """Whether a text names a model in a file, not a mechanism of the library."""
    file, _, attribute = name.rpartition(":")
    return Path(name).suffix in READERS or (file.endswith(".py") and attribute != "")


def refuse_file_alone(name: str) -> None:
    """Refuse FILE.py without :NAME, with the names of the file that could be meant."""
    if not name.removesuffix(":").endswith(".py"):
        return
    path = Path(name.removesuffix(":"))
    if not path.is_file():
        raise MechcError(f"there is no file {path}")
    defined: list[str] = []
    with suppress(SyntaxError, ValueError):
        defined = _names_in(ast.parse(path.read_text("utf-8")))
    words = f"; it defines {', '.join(defined)}" if defined else ""
    raise MechcError(
        f"{name}: say which model of the file, {path}:{defined[-1] if defined else 'MODEL'}, a "
        f"variable or a function{words}"
    )


def _names_in(module: ast.Module) -> list[str]:
    """Public variables and functions of a module, in their order: if there are any, those that may
    be models, variables made by MAKERS and functions without arguments."""
    names: dict[str, bool] = {}
    for node in module.body:
        if isinstance(node, ast.FunctionDef):
            given = node.args
            names[node.name] = len(given.args) + len(given.posonlyargs) == len(given.defaults)
        elif isinstance(node, ast.Assign):
            made = isinstance(node.value, ast.Call) and ast.unparse(node.value.func)
            is_model = bool(made) and str(made).rpartition(".")[2] in MAKERS
            names |= {t.id: is_model for t in node.targets if isinstance(t, ast.Name)}
    public = {name: is_model for name, is_model in names.items() if not name.startswith("_")}
    return [name for name, is_model in public.items() if is_model or not any(public.values())]


def own_name(name: str) -> str:
    """NAME of FILE.py:NAME, FILE of FILE.urdf."""
    return Path(name).stem if Path(name).suffix in READERS else name.rpartition(":")[2]


@cache
def own_object(name: str, options: tuple[tuple[str, Any], ...] = ()) -> Any:
    """The mechanism of a file; FILE.py is run, and NAME called if it is a function of nothing.

    ``options``: arguments of the reader of a robot.

    Raises :class:`MechcError` if there is no such file or name, or nothing that can be compiled.
    """
    reader = READERS.get(Path(name).suffix)
    path, _, attribute = (name, "", "") if reader else name.rpartition(":")
    if not Path(path).is_file():
        raise MechcError(f"there is no file {path}")
    if reader:
        return getattr(mechc, reader)(path, **dict(options))
    spec = importlib.util.spec_from_file_location("mechc_own_model", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    sys.path.insert(0, str(Path(path).resolve().parent))  # as where Python runs the file itself
    spec.loader.exec_module(module)
    found = getattr(module, attribute, None)
    if found is None:
        raise MechcError(f"{path} defines no {attribute!r}")
    return found() if callable(found) and not isinstance(found, mechc.Model) else found


def own_model(
    name: str, outputs: Sequence[str] | None = None, options: Mapping[str, Any] | None = None
) -> mechc.Model:
    """The model of FILE.py:NAME, compiled with these outputs unless it is a model already."""
    found = own_object(name, tuple((options or {}).items()))
    if isinstance(found, mechc.Model):
        return found
    try:
        return mechc.compile(found, outputs=outputs)
    except TypeError:
        raise MechcError(
            f"{name} is of type {type(found).__name__}: it has to be a mechc.Model, a "
            "mechc.Mechanism, a KanesMethod, LagrangesMethod or System of SymPy, or a function "
            "that returns one"
        ) from None
