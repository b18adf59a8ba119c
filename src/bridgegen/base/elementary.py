"""Elementary functions of numbers and arrays, with the bits that kernels get.

NumPy's and the system's own round otherwise on other processors; see `_elementary_kernels`. What
Python works out for a rollout, or as a kernel does, uses these. What helps users' drivers does not:
they run in processes of their own, where the compiler would first have to be imported.
"""

from functools import cache
from typing import Any, Protocol, overload

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Float


class Function(Protocol):
    """A function of one number or array, or of two that are broadcast."""

    @overload
    def __call__(self, x: float, y: float = ..., /) -> float: ...
    @overload
    def __call__(self, x: npt.ArrayLike, y: npt.ArrayLike = ..., /) -> Float: ...


@cache
def _kernels() -> Any:
    from bridgegen.base import _elementary_kernels  # numba is slow to import

    return _elementary_kernels


def _function(number: int) -> Function:
    def apply(x: Any, y: Any = 0.0, /) -> Any:
        if isinstance(x, float | int) and isinstance(y, float | int):
            return _kernels().value(number, float(x), float(y))
        x, y = np.asarray(x, np.float64), np.asarray(y, np.float64)
        out = np.empty(np.broadcast_shapes(x.shape, y.shape))
        # Copies, where need be: an array that may not be written has another type for the compiler.
        flat = [
            np.array(np.broadcast_to(value, out.shape), order="C").reshape(-1) for value in (x, y)
        ]
        _kernels().each(number, *flat, out.reshape(-1))
        return out

    return apply


(acos, asin, atan, atan2, cos, exp, expm1, hypot, log, log2, power, sin, tan, tanh) = map(
    _function, range(14)
)
"""They return a float of numbers, else float64; NaN and ±inf without a warning. ``atan2(y, x)``,
``power(x, y)``."""
