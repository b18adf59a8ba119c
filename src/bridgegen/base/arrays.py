"""Checks on arrays at the border to compiled code, which does not check them itself."""

from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

Float = npt.NDArray[np.float64]
Int = npt.NDArray[np.int64]
Bool = npt.NDArray[np.bool_]


def as_float(
    name: str, value: npt.ArrayLike, shape: tuple[int | None, ...], *, finite: bool = True
) -> Float:
    """Return ``value`` as a C-contiguous float64 array of the given shape.

    Args:
        name: what the array is, with its unit, for the message.
        value: anything that NumPy takes.
        shape: expected length per axis; ``None`` leaves one open.
        finite: refuse NaN and infinities.

    Raises:
        ValueError: the shape differs, or a value is not finite.
    """
    # A kernel is compiled anew for every layout and type of its arguments, and reads past the end
    # of an array that is too short: so both are settled here.
    array = np.ascontiguousarray(value, dtype=np.float64)
    if array.ndim != len(shape) or any(
        want is not None and have != want for have, want in zip(array.shape, shape, strict=True)
    ):
        want_text = "(" + ", ".join("·" if n is None else str(n) for n in shape) + ")"
        raise ValueError(f"{name} must have shape {want_text}, got {array.shape}")
    if finite and not np.isfinite(array).all():
        bad: Any = np.argwhere(~np.isfinite(array))[0].tolist()
        raise ValueError(f"{name} must be finite, got {array[tuple(bad)]} at {bad}")
    return array


class Numbers(Protocol):
    """A table of numbers that may be too long for memory: an array, or what reads rows of one.

    ``a[3]`` is a row, ``a[rows]`` the rows of a mask, of positions or of a stretch, ``a[:, 2]`` a
    column and ``a[rows, 2]`` some values of one; each an array of float64.
    """

    def __len__(self) -> int:
        """Return the number of rows."""

    def __getitem__(self, at: Any, /) -> Any:
        """Return rows, a column, or values of one."""


class Taken:
    """Some rows of a table, read when they are asked for.

    Args:
        table: of which.
        rows: ``(n,)`` positions.
    """

    def __init__(self, table: Numbers, rows: Int) -> None:
        self._table, self._rows = table, rows

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, at: Any, /) -> Any:
        rows, *column = at if isinstance(at, tuple) else (at,)
        return self._table[(self._rows[rows], *column) if column else self._rows[rows]]


def opposite(array: npt.NDArray[Any], columns: tuple[int, ...] | None = None) -> npt.NDArray[Any]:
    """Return 0 − array, or an array in which some columns of its last axis are so."""
    if columns is None:
        return 0.0 - array
    found = array.copy()
    found[..., columns] = 0.0 - array[..., columns]
    return found
