"""Chunks of a batch on the workers of a Dask cluster.

What is sent is a recipe (numbers, names, arrays) and a reference to the model.  Compiled objects
stay where they are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from mechc.batch.run import run_members
from mechc.batch.spec import Recipe
from mechc.compilation.find import system_of
from mechc.errors import MechcError, package
from mechc.system.parameters import Array
from mechc.system.reference import ModelReference
from mechc.system.system import System

AHEAD = 2  # chunks waiting per worker thread


def compute_on(
    client: Any, system: System, recipe: Recipe, ranges: Sequence[tuple[int, int]],
    report: Callable[[int], None],
) -> Iterator[tuple[int, dict[str, Array], bool]]:  # fmt: skip
    """Chunks in the order in which workers finish them; a lost one is computed by another worker.

    Raises :class:`MechcError` if a worker cannot get the model.
    """
    distributed = package(
        "distributed", "dask.distributed is not installed: pip install 'dask[distributed]'"
    )
    system.wait()  # workers find it in the cache
    reference = system.reference.exactly(system.instruction_set)
    left = iter(ranges)
    done = recipe.count - sum(last - first for first, last in ranges)

    def submit(first: int, last: int) -> Any:
        future = client.submit(run_chunk, reference, recipe.cut(first, last), pure=False)
        starts[future.key] = first
        return future

    starts: dict[str, int] = {}
    ahead = AHEAD * max(1, sum(client.nthreads().values()))
    waiting = distributed.as_completed(
        [submit(*r) for _, r in zip(range(ahead), left, strict=False)]
    )
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


def run_chunk(reference: ModelReference, recipe: Recipe) -> dict[str, Array]:
    """Compute the members of one chunk in a thread of a worker."""
    found, complete = run_members(system_of(reference), recipe, threads=1)
    if not complete:
        raise MechcError("the worker was interrupted")
    return found
