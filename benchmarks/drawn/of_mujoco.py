"""MuJoCo as the reference of MJCF texts: its accelerations, in doubles."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..timing.cases import Array
from .reference import Reference


class OfMujoco(Reference):
    """The rates of hinges and slides by ``mj_forward``."""

    def __init__(self, text: str) -> None:
        import mujoco

        self._mujoco: Any = mujoco
        self._model = mujoco.MjModel.from_xml_string(text)
        self._data = mujoco.MjData(self._model)
        joints = [self._model.joint(k).name for k in range(self._model.njnt)]
        self.names = [f"{x}_{name}" for x in "qu" for name in joints]
        self.parameters: list[str] = []
        self.closing_parameters: set[str] = set()
        self.fixed: dict[str, float] = {}
        self.size, self.closes, self.stop = len(self.names), False, None

    def rates(self, params: dict[str, float]) -> Callable[[float, Array], Array]:
        """y' of t and y; gravity is that of the text."""
        half = self.size // 2

        def of(t: float, y: Array) -> Array:
            self._data.qpos[:], self._data.qvel[:] = y[:half], y[half:]
            self._mujoco.mj_forward(self._model, self._data)
            return np.concatenate([y[half:], self._data.qacc])

        return of

    def exact(self, t: float, y: Sequence[float], params: dict[str, float]) -> Array:
        """y' in doubles."""
        return self.rates(params)(t, np.asarray(y, float))
