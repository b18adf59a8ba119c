"""A driver of the user's own that is compiled: a function of one scenario at one instant.

    from bridgegen.ego.compiled import compiled_driver

    @compiled_driver(memory=1)
    def drive(scene, ego, route, tracks, memory):
        return acceleration, curvature

It is written in the Python that numba compiles, and called inside the rollout without overhead. It
gets for one scenario what a class gets for many (`Observation`, `Scene`), in records with the
fields of ``SCENE``, ``EGO``, ``ROUTE`` and ``TRACK``: ``ego.v``, ``route[3].x``, ``tracks[0].vx``.
"""

import inspect
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from bridgegen.errors import InputError


def _record(*names: str) -> np.dtype[Any]:
    return np.dtype([(name, np.float64) for name in names])


SCENE = _record(
    "time_step", "n_steps", "length", "width", "centre",
    "max_speed", "max_acceleration", "max_deceleration", "max_curvature",
)  # fmt: skip
"""What does not change, see `bridgegen.ego.interface.Scene`; all are float64."""

EGO = _record(
    "time", "x", "y", "h", "v", "a", "target_speed", "offset", "stop_distance", "light"
)  # fmt: skip
"""The ego, see `Observation`."""

ROUTE = _record("x", "y", "h", "curvature")
"""A point of the route ahead [m, rad, 1/m]; there are ``ROUTE_POINTS``, every ``ROUTE_STEP``."""

TRACK = _record(
    "state", "x", "y", "h", "vx", "vy", "length", "width", "kind", "confidence", "unseen", "age",
    "lamps",
)  # fmt: skip
"""One of the M other participants as the sensors track them, see `Observation.tracks`."""

ARGUMENT_TYPES = (SCENE, EGO, ROUTE, TRACK, np.dtype(np.float64))
"""The record type of each argument; scene and ego are one record, the others arrays of them."""


class CompiledDriver:
    """A driver that `compiled_driver` makes from a function; calling it calls the function.

    Attributes:
        memory: how many numbers it keeps between two instants.
    """

    def __init__(self, function: Callable[..., tuple[float, float]], memory: int) -> None:
        self._function = function
        self.memory = memory
        self._code: Any = None  # keeps the machine code where it is

    def __call__(self, *arguments: Any) -> tuple[float, float]:
        """Call the function in Python, to test or debug it."""
        return self._function(*arguments)

    @property
    def address(self) -> int:
        """The address of its machine code, compiled if need be; see `compiled.call_at`.

        The arguments are arrays of the types of ``ARGUMENT_TYPES``, and one for the answer:
        acceleration, curvature, and a 1 if it has returned and not raised an error.

        Raises:
            InputError: numba cannot compile it, with the reason and the line.
        """
        if self._code is None:
            self._code = _compile(self._function)
        address: int = self._code.address
        return address


def compiled_driver(
    *, memory: int = 0
) -> Callable[[Callable[..., tuple[float, float]]], CompiledDriver]:
    """Make a driver from a function ``(scene, ego, route, tracks, memory)``.

    The function returns the acceleration [m/s²] and the curvature [1/m] that it demands, see
    `Control`. Its arguments are copies. Indices are checked; division by zero follows IEEE 754.

    Args:
        memory: how many numbers it keeps: ``memory`` is ``(memory,)`` float64, zeros at the start
            of each scenario, later as the function left it. No other state persists: numba
            treats globals as constants.

    Raises:
        InputError: not a whole number >= 0.
    """
    if not isinstance(memory, int) or memory < 0:
        raise InputError(f"memory must be a whole number >= 0, got {memory!r}")
    return lambda function: CompiledDriver(function, memory)


def _compile(function: Callable[..., Any]) -> Any:
    """Return the C callback of a function; see `CompiledDriver.address`."""
    import numba

    if numba.config.DISABLE_JIT:
        raise InputError("a compiled driver must be compiled, which NUMBA_DISABLE_JIT forbids")
    if len(inspect.signature(function).parameters) != len(ARGUMENT_TYPES):
        raise InputError(
            f"{_place(function)}: {function.__name__} must take scene, ego, route, tracks, memory"
        )
    code = numba.njit(nogil=True, error_model="numpy", boundscheck=True)(function)
    kinds = [numba.from_dtype(kind) for kind in ARGUMENT_TYPES]
    arrays = [numba.types.Array(kind, 1, "C", aligned=kind is kinds[-1]) for kind in kinds[2:]]
    try:
        code.compile((*kinds[:2], *arrays))
        returned = code.nopython_signatures[0].return_type
        numbers = getattr(returned, "types", ())
        real = (numba.types.Integer, numba.types.Float)
        if len(numbers) != 2 or not all(isinstance(one, real) for one in numbers):
            raise InputError(
                f"{_place(function)}: {function.__name__} must return (acceleration, curvature), "
                f"returns {returned}"
            )
        return _callback(code)
    except InputError:
        raise
    except Exception as error:  # numba's passes raise exceptions of any type
        raise InputError(_described(function, error)) from None


def _callback(code: Any) -> Any:
    import numba
    from numba import carray

    scene_type, ego_type, route_type, track_type, number = ARGUMENT_TYPES

    def call(scene, _1, ego, _2, route, n, tracks, m, memory, size, answer, _3):  # type: ignore[no-untyped-def]
        acceleration, curvature = code(
            carray(scene, (1,), scene_type)[0],
            carray(ego, (1,), ego_type)[0],
            carray(route, (n,), route_type),
            carray(tracks, (m,), track_type),
            carray(memory, (size,), number),
        )
        out = carray(answer, (3,), number)
        out[0], out[1], out[2] = acceleration, curvature, 1.0

    signature = numba.types.void(*[numba.types.voidptr, numba.types.intp] * 6)
    return numba.cfunc(signature, nopython=True, error_model="numpy")(call)


def _described(function: Callable[..., Any], error: Exception) -> str:
    """Return in one line why numba cannot compile a function."""
    text = re.sub(r"\x1b\[[0-9;]*m", "", str(error))
    if isinstance(error, KeyError):  # a field that the record lacks
        text = f"there is no field {text}"
        line = _line_with(function, f".{error.args[0]}")
        return f"{_place(function, line)}: {function.__name__} cannot be compiled: {text}"
    found = re.search(r'File "([^"]+)", line (\d+)', text)
    place = f"{Path(found[1]).name}:{found[2]}" if found else _place(function)
    lines = [line.strip() for line in text.splitlines()]
    words = [line for line in lines if line and not line.startswith("Failed in nopython")]
    reason = words[0] if words else type(error).__name__
    if reason.endswith(":") and len(words) > 1:  # "no implementation of … for signature:"
        reason = f"{reason} {words[1].removeprefix('>>> ')}"
    return f"{place}: {function.__name__} cannot be compiled: {reason}"


def _place(function: Callable[..., Any], line: int | None = None) -> str:
    code = function.__code__
    return f"{Path(code.co_filename).name}:{line or code.co_firstlineno}"


def _line_with(function: Callable[..., Any], text: str) -> int | None:
    try:
        lines, first = inspect.getsourcelines(function)
    except OSError:
        return None
    return next((first + i for i, line in enumerate(lines) if text in line), None)
