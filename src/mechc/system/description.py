"""The metadata of a scene: names, units, bounds, drawing."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from itertools import product
from types import MappingProxyType
from typing import Any

from mechc.errors import UnknownNameError
from mechc.system.names import name_of
from mechc.system.quantity import NamedQuantity


class Description:
    """The metadata of a compiled scene.

    Attributes
    ----------
    name, title
        Its name in code, and its title for people.
    coordinates, speeds
        Names, in the order of a state y = [q, u].
    states
        The last of the coordinates, which have differential equations and no speed:
        activations, controllers.
    parameters, inputs
        Names, in order.
    """

    def __init__(self, data: Mapping[str, Any]) -> None:
        self.data = data
        self.name: str = data["name"]
        self.title: str = data["title"]
        self.coordinates: tuple[str, ...] = tuple(q["name"] for q in data["coordinates"])
        self.speeds: tuple[str, ...] = tuple(u["name"] for u in data["speeds"])
        self.parameters: tuple[str, ...] = tuple(p["name"] for p in data["parameters"])
        self.inputs: tuple[str, ...] = tuple(slot["name"] for slot in data.get("inputs", ()))
        self.states = self.coordinates[len(self.coordinates) - len(data.get("states", ())) :]
        self._state_index = {n: i for i, n in enumerate((*self.coordinates, *self.speeds))}

    @cached_property
    def quantities(self) -> Mapping[str, NamedQuantity]:
        """The coordinates, speeds and parameters by name."""
        kinds = ("coordinates", "speeds", "parameters")
        found = (NamedQuantity.from_metadata(each) for kind in kinds for each in self.data[kind])
        return MappingProxyType({quantity.name: quantity for quantity in found})

    @property
    def units(self) -> Mapping[str, str]:
        """Unit of every coordinate, speed and parameter."""
        return {name: q.unit for name, q in self.quantities.items()}

    @property
    def descriptions(self) -> Mapping[str, str]:
        """One line on every coordinate, speed and parameter."""
        return {name: q.description for name, q in self.quantities.items()}

    @property
    def bounds(self) -> Mapping[str, tuple[float, float]]:
        """(lower, upper) of every coordinate, speed and parameter."""
        return {name: (q.lower, q.upper) for name, q in self.quantities.items()}

    @property
    def point_names(self) -> tuple[str, ...]:
        """Names of the points, in the order of :meth:`mechc.Model.points`."""
        return tuple(self.data["points"])

    @property
    def body_names(self) -> tuple[str, ...]:
        """Names of the bodies, in the order of :meth:`mechc.Model.momenta`."""
        return tuple(self.data["bodies"])

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, in the order of :meth:`mechc.Model.reactions`; empty without."""
        return tuple(self.data["joints"])

    @property
    def constraint_names(self) -> tuple[str, ...]:
        """Names of the constraint rows, configuration constraints first."""
        return tuple(c["name"] for c in self.data["constraints"])

    @cached_property
    def gap_unit(self) -> str:
        """The unit that all configuration constraints are known to have, else ""."""
        rows = [str(c["unit"]) for c in self.data["constraints"]]
        units = {unit for unit in rows if not unit.endswith("/s")}
        return units.pop() if len(units) == 1 else ""

    @property
    def skeleton(self) -> tuple[tuple[str, tuple[str, ...]], ...]:
        """The lines drawn, each (label, names of the points of a polyline)."""
        return tuple((label, tuple(points)) for label, points in self.data["links"])

    @property
    def ground(self) -> tuple[str, ...]:
        """Names of the points drawn as pivots on the ground."""
        return tuple(self.data["ground"])

    @property
    def traced(self) -> tuple[str, ...]:
        """Names of the points whose path is drawn."""
        return tuple(self.data["traced"])

    @property
    def view(self) -> tuple[str, str] | None:
        """The axes of pictures, to the right and up, such as ("x", "-y"); None: by spread."""
        right_up = self.data.get("view")
        return (str(right_up[0]), str(right_up[1])) if right_up else None

    @property
    def start(self) -> Mapping[str, float]:
        """Coordinates and speeds that ``mechc run`` starts from, SI units."""
        return dict(self.data["start"])

    @cached_property
    def array_outputs(self) -> Mapping[str, tuple[int, ...]]:
        """User-defined outputs that are vectors, matrices or lists, and their shapes."""
        found = self.data.get("arrays", {})
        return MappingProxyType({name: tuple(shape) for name, shape in found.items()})

    def array_elements(self, name: str) -> list[str]:
        """Names of the elements of such an output, row after row."""
        if not isinstance(name, str) or name not in self.array_outputs:
            raise UnknownNameError("output with several elements", name, self.array_outputs)
        places = product(*map(range, self.array_outputs[name]))
        return [f"{name}[{','.join(map(str, place))}]" for place in places]

    def coordinates_and_speeds(
        self, values: Mapping[str, Any]
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Values of a start by name: those of the coordinates, and those of the speeds."""
        speeds = {name: value for name, value in values.items() if name in self.speeds}
        return {name: value for name, value in values.items() if name not in speeds}, speeds

    def state_index(self, name: Any) -> int:
        """The index in y of a coordinate or speed, by name or symbol."""
        index = self._state_index.get(name) if isinstance(name, str) else None
        index = self._state_index.get(name_of(name)) if index is None else index
        if index is None:
            raise UnknownNameError("coordinate or speed", name_of(name), self._state_index)
        return index
