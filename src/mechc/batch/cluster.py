"""Chunks of a batch on the workers of a Dask cluster.

What travels is a recipe (numbers, names, arrays) and where the worker finds the model: a shipped
mechanism's name and options, or the key of an entry in the cache.  Compiled objects stay where
they are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from mechc.batch.run import run_members
from mechc.batch.spec import Recipe
from mechc.compilation.one_at_a_time import one_at_a_time
from mechc.errors import MechcError, MissingPackageError
from mechc.system.parameters import Array

if TYPE_CHECKING:
    from mechc.model import Model

AHEAD = 2  # chunks waiting per worker thread


def compute_on(
    client: Any, model: Model, recipe: Recipe, ranges: Sequence[tuple[int, int]],
    report: Callable[[int], None],
) -> Iterator[tuple[int, dict[str, Array], bool]]:  # fmt: skip
    """Chunks as the workers finish them; one lost with its worker is computed by another.

    Raises
    ------
    MechcError
        If a worker cannot get the model.
    """
    try:
        from distributed import as_completed
    except ImportError:
        raise MissingPackageError(
            "dask.distributed is not installed: pip install 'dask[distributed]'"
        ) from None
    place = described(model)
    assert model._scene.capsule  # compiled to the end before others look for it
    left = iter(ranges)
    done = recipe.count - sum(last - first for first, last in ranges)

    def submit(first: int, last: int) -> Any:
        future = client.submit(run_chunk, place, recipe.cut(first, last), pure=False)
        starts[future.key] = first
        return future

    starts: dict[str, int] = {}
    ahead = AHEAD * max(1, sum(client.nthreads().values()))
    waiting = as_completed([submit(*r) for _, r in zip(range(ahead), left, strict=False)])
    for future in waiting:
        found = future.result()
        first = starts.pop(future.key)
        future.release()
        following = next(left, None)
        if following is not None:
            waiting.add(submit(*following))
        done += len(found["t"])
        report(done)
        yield first, found, True


def described(model: Model) -> dict[str, Any]:
    """Where another process finds the same compiled scene."""
    return {
        "name": model.name,
        "options": dict(model.options),
        "instruction_set": model.instruction_set,
        "key": model.build.get("key") if model.build.get("custom") else None,
    }


def run_chunk(place: dict[str, Any], recipe: Recipe) -> dict[str, Array]:
    """What a worker does: one of its threads runs the members of one chunk."""
    found, complete = run_members(_model(place), recipe, threads=1)
    if not complete:
        raise MechcError("the worker was interrupted")
    return found


@one_at_a_time
def _model(place: dict[str, Any]) -> Model:
    if place["key"] is not None:
        from mechc.compilation.on_demand import compiled_before

        return compiled_before(place["key"], place["name"])
    from mechc.load import load

    model = load(place["name"], **place["options"])
    if model.instruction_set == place["instruction_set"]:
        return model
    return load(place["name"], instruction_set=place["instruction_set"])
