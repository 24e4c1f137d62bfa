"""All models, by name: each module enters its own."""

from . import cranes_and_machines, flight, linkages, muscles, pendula, rolling, tops, vehicles
from .script import MODELS

FAMILIES = {
    module.__name__.rpartition(".")[2]: tuple(
        name for name, model in MODELS.items() if model.derive.__module__ == module.__name__
    )
    for module in (
        *(pendula, rolling, vehicles, muscles, flight, tops, cranes_and_machines, linkages),
    )
}

__all__ = ["FAMILIES", "MODELS"]
