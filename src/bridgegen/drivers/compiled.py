"""A driver of the user's own that is compiled: a function of one scenario at one instant.

    from bridgegen.drivers.compiled import compiled_driver

    @compiled_driver(memory=1)
    def drive(scene, ego, route, tracks, memory):
        return acceleration, curvature

One that wants more (see `bridgegen.drivers.interface.WANTS`) gets further arguments, in its order:

    @compiled_driver(wants=("lanes",))
    def drive(scene, ego, route, tracks, memory, lanes):
        room = lanes.beside[0, 0, 1]

It is written in the Python that numba compiles, and called inside the rollout without overhead. It
gets for one scenario what a class gets for many (`Observation`, `Scene`), in records with the
fields of ``SCENE``, ``EGO``, ``ROUTE`` and ``TRACK``: ``ego.v``, ``route[3].x``, ``tracks[0].vx``.
"""

import inspect
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bridgegen.base.errors import InputError
from bridgegen.drivers.interface import (
    CONFLICT_WAYS,
    HISTORY,
    NEAR_PIECES,
    PIECE_POINTS,
    ROUTE_POINTS,
)
from bridgegen.drivers.tunable import Tunable, checked_tunable
from bridgegen.drivers.user_drivers import checked_wants

ANY = -1  # the size of an axis that depends on the scenario


def _record(*names: str) -> np.dtype[Any]:
    return np.dtype([(name, np.float64) for name in names])


SCENE = _record(
    "time_step",
    "n_steps",
    "length",
    "width",
    "centre",
    "max_speed",
    "max_acceleration",
    "max_deceleration",
    "max_curvature",
)
"""Record of what is constant in a scenario, see `bridgegen.drivers.interface.Scene`; all are
float64."""

EGO = _record("time", "x", "y", "h", "v", "a", "target_speed", "offset", "stop_distance", "light")
"""Record of the ego's state, see `Observation`."""

ROUTE = _record("x", "y", "h", "curvature")
"""A point of the route ahead [m, rad, 1/m]; there are ``ROUTE_POINTS``, every ``ROUTE_STEP``."""

TRACK = _record(
    "state", "x", "y", "h", "vx", "vy", "length", "width", "kind", "confidence", "unseen", "age",
    "lamps",
)  # fmt: skip
"""One of the M other participants as the sensors track them, see `Observation.tracks`."""

LANES = np.dtype(
    [
        ("speed_limit", np.float64, (ROUTE_POINTS,)),
        ("width", np.float64, (ROUTE_POINTS,)),
        ("junction", np.float64, (ROUTE_POINTS,)),
        ("beside", np.float64, (ROUTE_POINTS, 2, 4)),
        ("ends", np.float64),
        ("goal", np.float64, (3,)),
        ("stop_sign", np.float64),
        ("crosswalk", np.float64, (4,)),
    ]
)
"""The road along the route, see `bridgegen.drivers.interface.Lanes`; one record."""

PIECE = np.dtype(
    [
        ("points", np.float64, (PIECE_POINTS, 3)),
        ("width", np.float64, (PIECE_POINTS,)),
        *(
            (name, np.float64)
            for name in (
                "count",
                "kind",
                "lane",
                "light",
                "marking",
                "speed_limit",
                "on_route",
            )
        ),
    ]
)
"""A piece of the map, see `bridgegen.drivers.interface.RoadMap`; kind -1 where there is none.

``width`` is the lane's [m] at the points of a centre line, 0 of other pieces.
"""

PLACE = np.dtype([("lane", np.int64), ("near", np.int64, (NEAR_PIECES,))])
"""Record of the ego's lane and the pieces of the map near it, see
`bridgegen.drivers.interface.MapView`."""

CONFLICT = _record("enter", "leave", "other_enter", "other_leave", "priority", "how")
"""One way of a participant across the route, see `bridgegen.drivers.interface.Conflicts`."""

WANTED: dict[str, tuple[tuple[str, np.dtype[Any], tuple[int, ...]], ...]] = {
    "lanes": (("lanes", LANES, ()),),
    "map": (
        ("pieces", PIECE, (ANY,)),
        ("place", PLACE, ()),
        ("lights", np.dtype(np.float64), (ANY,)),
    ),
    "conflicts": (("conflicts", CONFLICT, (ANY, CONFLICT_WAYS)),),
    "history": (("history", TRACK, (ANY, HISTORY)),),
}
"""The further arguments by the word of `WANTS`: name, type and shape; () is one record.

``pieces`` are those of the whole map, ``lights`` the states of its lights; ``conflicts`` and
``history`` have a row for each of the M other participants.
"""

ARGUMENT_TYPES = (SCENE, EGO, ROUTE, TRACK, np.dtype(np.float64))
"""The record type of each argument; scene and ego are one record, the others arrays of them."""


class CompiledDriver:
    """A driver that `compiled_driver` makes from a function; calling it calls the function.

    Attributes:
        memory: how many numbers it keeps between two instants.
        wants: words of `WANTS`, in the order of its arguments.
        tunable: its numbers that may be set.
    """

    def __init__(
        self,
        function: Callable[..., tuple[float, float]],
        memory: int,
        wants: tuple[str, ...] = (),
        tunable: tuple[Tunable, ...] = (),
    ) -> None:
        self._function = function
        self.memory, self.wants, self.tunable = memory, wants, tunable
        # Where the code reads them: other values need no other code.
        self._settings = np.zeros(1, _record(*(item.name for item in tunable)))
        self.set({item.name: item.default for item in tunable})
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
            self._code = _compile(self._function, self.wants, self._settings)
        address: int = self._code.address
        return address

    def set(self, values: Mapping[str, float]) -> None:
        """Set the tunable numbers, all of them; they hold from the next call on."""
        for name, value in values.items():
            self._settings[name] = value


def compiled_driver(
    *, memory: int = 0, wants: Iterable[str] = (), tunable: Mapping[str, Any] | None = None
) -> Callable[[Callable[..., tuple[float, float]]], CompiledDriver]:
    """Make a driver from a function ``(scene, ego, route, tracks, memory)``.

    The function returns the acceleration [m/s²] and the curvature [1/m] that it demands, see
    `Control`. Its arguments are copies. Indices are checked; division by zero follows IEEE 754.

    Args:
        memory: how many numbers it keeps: ``memory`` is ``(memory,)`` float64, zeros at the start
            of each scenario, later as the function left it. No other state persists: numba
            treats globals as constants.
        wants: what else it gets, in the order of its further arguments, see `WANTED`.
        tunable: numbers that may be set: names with (default, low, high) or (default, low, high,
            unit). Its last argument then is a record of their values: ``settings.headway``.

    Raises:
        InputError: not a whole number >= 0, what is wanted is unknown, or a tunable number has no
            range.
    """
    if not isinstance(memory, int) or memory < 0:
        raise InputError(f"memory must be a whole number >= 0, got {memory!r}")
    words, numbers = checked_wants(wants), checked_tunable(tunable)
    if "seed" in words:
        raise InputError("a compiled driver is given no seed: leave 'seed' out of wants")
    return lambda function: CompiledDriver(function, memory, words, numbers)


def _compile(function: Callable[..., Any], wants: Sequence[str], settings: Any) -> Any:
    """Return the C callback of a function; see `CompiledDriver.address`."""
    import numba

    if numba.config.DISABLE_JIT:
        raise InputError("a compiled driver must be compiled, which NUMBA_DISABLE_JIT forbids")
    further = [argument for word in wants for argument in WANTED[word]]
    own = [settings.dtype] if settings.dtype.names else []
    names = ["scene", "ego", "route", "tracks", "memory", *(name for name, *_ in further)]
    names += ["settings" for _ in own]
    if len(inspect.signature(function).parameters) != len(names):
        raise InputError(f"{_place(function)}: {function.__name__} must take {', '.join(names)}")
    # Indices are checked here, other than in our kernels: a write beyond an array would take the
    # driver's process down, where an error names the line.
    code = numba.njit(nogil=True, error_model="numpy", boundscheck=True)(function)
    shapes = [(), (), *[(ANY,)] * 3, *(shape for *_, shape in further), *(() for _ in own)]
    types = [*ARGUMENT_TYPES, *(kind for _, kind, _ in further), *own]
    try:
        code.compile(tuple(map(_type_of, types, shapes)))
        returned = code.nopython_signatures[0].return_type
        numbers = getattr(returned, "types", ())
        real = (numba.types.Integer, numba.types.Float)
        if len(numbers) != 2 or not all(isinstance(number, real) for number in numbers):
            raise InputError(
                f"{_place(function)}: {function.__name__} must return (acceleration, curvature), "
                f"returns {returned}"
            )
        return _callback(code, wants, settings)
    except InputError:
        raise
    except Exception as error:  # numba's passes raise exceptions of any type
        raise InputError(_described(function, error)) from None


def _type_of(kind: np.dtype[Any], shape: tuple[int, ...]) -> Any:
    """Return Numba's type of an argument."""
    import numba

    found = numba.from_dtype(kind)
    if not shape:
        return found
    return numba.types.Array(found, len(shape), "C", aligned=not kind.names)


def _callback(code: Any, wants: Sequence[str], settings: Any) -> Any:
    import numba
    from numba import carray

    scene_type, ego_type, route_type, track_type, number = ARGUMENT_TYPES
    ask = _with_wanted(code, wants, settings)

    def call(  # type: ignore[no-untyped-def]
        scene, _1, ego, _2, route, n, tracks, m, memory, size, answer, _3, lanes, _4,
        pieces, n_pieces, place, _5, lights, n_lights, conflicts, n_conflicts, history, n_history,
    ):  # fmt: skip
        plain = (
            carray(scene, (1,), scene_type)[0],
            carray(ego, (1,), ego_type)[0],
            carray(route, (n,), route_type),
            carray(tracks, (m,), track_type),
            carray(memory, (size,), number),
        )
        acceleration, curvature = ask(
            (lanes, pieces, place, lights, conflicts, history),
            (1, n_pieces, 1, n_lights, n_conflicts, n_history),
            plain,
        )
        out = carray(answer, (3,), number)
        # The 1 last: what raises before has not written it.
        out[0], out[1], out[2] = acceleration, curvature, 1.0

    signature = numba.types.void(*[numba.types.voidptr, numba.types.intp] * 12)
    return numba.cfunc(signature, nopython=True, error_model="numpy")(call)


# One signature in C for all drivers, whatever they want: so the rollout that calls them is compiled
# once, and kept on disk whatever the user writes. A call takes 21 ns.
def _with_wanted(code: Any, wants: Sequence[str], settings: Any) -> Any:
    """Return a function of all pointers and sizes, and of a tuple of the plain arguments.

    It calls the code with these and with what is wanted. (A function cannot return records.)
    """
    import numba
    import numba.extending
    from numba import carray

    def call(then: Any, at: int, kind: Any, shape: tuple[int, ...]) -> Any:
        width = shape[-1] if shape else 0

        @numba.njit
        def with_record(pointers, sizes, given):  # type: ignore[no-untyped-def]
            return then(pointers, sizes, (*given, carray(pointers[at], (1,), kind)[0]))

        @numba.njit
        def with_rows(pointers, sizes, given):  # type: ignore[no-untyped-def]
            return then(pointers, sizes, (*given, carray(pointers[at], (sizes[at],), kind)))

        @numba.njit
        def with_table(pointers, sizes, given):  # type: ignore[no-untyped-def]
            return then(pointers, sizes, (*given, carray(pointers[at], (sizes[at], width), kind)))

        return (with_record, with_rows, with_table)[len(shape)]

    @numba.extending.intrinsic
    def pointer(_, address):  # type: ignore[no-untyped-def]
        def generate(context, builder, signature, given):  # type: ignore[no-untyped-def]
            return builder.inttoptr(given[0], context.get_value_type(numba.types.voidptr))

        return numba.types.voidptr(address), generate

    kept, place = settings.dtype, settings.ctypes.data

    @numba.njit
    def set_last(pointers, sizes, given):  # type: ignore[no-untyped-def]
        return code(*given, carray(pointer(place), (1,), kept)[0])

    @numba.njit
    def plain(pointers, sizes, given):  # type: ignore[no-untyped-def]
        return code(*given)

    found = set_last if kept.names else plain
    names = [name for arguments in WANTED.values() for name, *_ in arguments]
    for name, kind, shape in reversed([pair for word in wants for pair in WANTED[word]]):
        found = call(found, names.index(name), kind, shape)
    return found


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
