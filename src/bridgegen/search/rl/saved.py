"""The state of a learner, as plain arrays: it is never executed."""

import json
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt


class Saved:
    """An algorithm whose next rows depend on arrays alone; see `Restorable`.

    The arrays are its working state, in one order, with constant shapes.
    """

    name: ClassVar[str]
    _values: Mapping[str, Any]
    _arrays: Mapping[str, npt.NDArray[Any]]

    def state(self) -> bytes:
        """Return networks, optimisers, memory and walkers: a line of JSON, then plain arrays."""
        return self._header() + b"".join(array.tobytes() for array in self._arrays.values())

    def restore(self, state: bytes) -> None:
        """Restore the state of an algorithm.

        Raises:
            ValueError: the state is of another algorithm, other settings or metrics, other versions
                of its libraries; or it is damaged.
        """
        header, arrays = self._header(), self._arrays.values()
        if not state.startswith(header):
            raise ValueError(f"it is not a state of {self.name} with these settings and metrics")
        if len(state) != len(header) + sum(array.nbytes for array in arrays):
            raise ValueError("it has the wrong length")
        parts, at = [], len(header)
        for array in arrays:
            part = np.frombuffer(state, array.dtype, array.size, at).reshape(array.shape)
            if part.dtype.kind == "f" and np.isnan(part).any():
                raise ValueError("it holds NaN")
            parts.append(part)
            at += array.nbytes
        for array, part in zip(arrays, parts, strict=True):
            array[...] = part

    def _header(self) -> bytes:
        shapes = [[key, one.dtype.str, one.shape] for key, one in self._arrays.items()]
        return json.dumps([self.name, self._values, shapes]).encode() + b"\n"
