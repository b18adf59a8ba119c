"""The functions of esmini's library that are used, with their types.

It holds one scenario at a time for the whole process, and what it cannot do may end the process; so
it is loaded in processes of its own (`process.py`), never in the one that searches.

Source: esminiLib.hpp of esmini 3.6, https://github.com/esmini/esmini (MPL-2.0).
"""

import ctypes
import re
from collections.abc import Callable
from pathlib import Path

from bridgegen.base import elementary
from bridgegen.base.errors import InputError

OLDEST = 3
"""The oldest major version with these functions and structures."""

EVENT, RUNNING = 6, 2  # StoryBoardElement::ElementType and ::State

_Changed = ctypes.CFUNCTYPE(None, ctypes.c_char_p, ctypes.c_int, ctypes.c_int, ctypes.c_char_p)


class _State(ctypes.Structure):
    """SE_ScenarioObjectState, with room for fields that a later version appends."""

    _fields_ = [
        *((name, ctypes.c_int) for name in ("id", "model_id", "ctrl_type")),
        *((name, ctypes.c_double) for name in ("timestamp", "x", "y", "z", "h", "p", "r")),
        *((name, ctypes.c_uint32) for name in ("road_id", "junction_id")),
        ("t", ctypes.c_double),
        ("lane_id", ctypes.c_int),
        *((name, ctypes.c_double) for name in ("lane_offset", "s", "speed")),
        *((name, ctypes.c_double) for name in ("center_x", "center_y", "center_z")),
        *((name, ctypes.c_double) for name in ("width", "length", "height")),
        ("room", ctypes.c_ubyte * 512),
    ]


_TEXT, _INT, _DOUBLE = ctypes.c_char_p, ctypes.c_int, ctypes.c_double
_FUNCTIONS = {
    "SE_Init": (_INT, _TEXT, _INT, _INT, _INT, _INT),
    "SE_Close": (None,),
    "SE_StepDT": (_INT, _DOUBLE),
    "SE_GetQuitFlag": (_INT,),
    "SE_GetSimulationTime": (_DOUBLE,),
    "SE_GetIdByName": (_INT, _TEXT),
    "SE_GetObjectState": (_INT, _INT, ctypes.POINTER(_State)),
    "SE_ReportObjectPosXYH": (_INT, _INT, _DOUBLE, _DOUBLE, _DOUBLE),
    "SE_ReportObjectSpeed": (_INT, _INT, _DOUBLE),
    "SE_ReportObjectVel": (_INT, _INT, _DOUBLE, _DOUBLE, _DOUBLE),
    "SE_ReportObjectAcc": (_INT, _INT, _DOUBLE, _DOUBLE, _DOUBLE),
    "SE_SetSeed": (None, ctypes.c_uint),
    "SE_LogToConsole": (None, ctypes.c_bool),
    "SE_SetLogFilePath": (None, _TEXT),
    "SE_SetOptionValuePersistent": (_INT, _TEXT, _TEXT),
    "SE_RegisterStoryBoardElementStateChangeCallback": (None, _Changed),
}


class Library:
    """esmini, loaded into this process.

    Args:
        path: of libesminiLib.so, esminiLib.dll or libesminiLib.dylib.

    Attributes:
        path: it.
        version: as it says of itself; "unknown" where it does not.

    Raises:
        InputError: it cannot be loaded, is not esmini's library, or is too old.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        if not path.is_file():
            raise InputError(f"{path}: there is no such file (esmini's library)")
        try:
            self._functions = ctypes.CDLL(str(path.resolve()))
        except OSError as error:
            raise InputError(f"{path}: cannot be loaded as esmini's library: {error}") from None
        if not hasattr(self._functions, "SE_Init"):
            raise InputError(f"{path}: is not esmini's library: it has no function SE_Init")
        self.version = self._version()
        lacks = [name for name in _FUNCTIONS if not hasattr(self._functions, name)]
        major = re.search(r"(\d+)\.\d+", self.version)
        if lacks or (major and int(major[1]) < OLDEST):
            why = f"its version is {self.version}" if major else f"it has no function {lacks[0]}"
            raise InputError(f"{path}: must be the library of esmini {OLDEST} or later; {why}")
        for name, (result, *arguments) in _FUNCTIONS.items():
            function = getattr(self._functions, name)
            function.restype, function.argtypes = result, arguments
        self._state = _State()
        self._callback: object = None  # is called while the scenario runs, so it must live

    def _version(self) -> str:
        """Return the version of the library; on Windows it is unknown."""
        for name in ("ESMINI_GIT_TAG", "ESMINI_BUILD_VERSION"):
            try:
                said = ctypes.c_char_p.in_dll(self._functions, name).value
            except ValueError:
                continue
            if said and re.search(r"\d", text := said.decode(errors="replace")):
                return text
        return "unknown"

    def begin(self, scenario: Path, log: Path, began: Callable[[str], None]) -> bool:
        """Load a scenario and set its first instant; return whether that succeeded.

        Args:
            scenario: the ``.xosc`` file.
            log: the file to write its log to.
            began: is called with the path of each event that starts.
        """
        call = self._functions
        call.SE_LogToConsole(False)
        call.SE_SetLogFilePath(str(log).encode())
        # By default esmini drops vertices less than 0.1 m apart: 16 of 34 recorded files were
        # within 0.05 m. Without the filter all agree to a micrometre.
        for option, value in (("log_level", "warn"), ("traj_filter", "0")):
            call.SE_SetOptionValuePersistent(option.encode(), value.encode())
        # Without a route esmini takes a random way at a junction.
        call.SE_SetSeed(0)

        def changed(name: bytes, kind: int, state: int, path: bytes) -> None:
            if kind == EVENT and state == RUNNING:
                began(path.decode(errors="replace"))

        self._callback = _Changed(changed)
        call.SE_RegisterStoryBoardElementStateChangeCallback(self._callback)
        return bool(call.SE_Init(str(scenario).encode(), 0, 0, 0, 0) == 0)

    def close(self) -> None:
        """End the scenario and complete its log."""
        self._functions.SE_Close()

    def step(self, seconds: float) -> None:
        """Evaluate all conditions, execute actions, and move all entities."""
        self._functions.SE_StepDT(seconds)

    @property
    def is_over(self) -> bool:
        """Whether its stop trigger has fired."""
        return bool(self._functions.SE_GetQuitFlag() != 0)

    @property
    def time(self) -> float:
        """Return the simulation time [s]."""
        return float(self._functions.SE_GetSimulationTime())

    def number(self, name: str) -> int:
        """Return the number of an entity; -1 if it does not exist."""
        return int(self._functions.SE_GetIdByName(name.encode()))

    def state(self, number: int) -> tuple[float, float, float, float] | None:
        """Return x, y [m] of an entity's reference point, heading [rad] and speed [m/s]."""
        state = self._state
        if self._functions.SE_GetObjectState(number, ctypes.byref(state)) != 0:
            return None
        return state.x, state.y, state.h, state.speed

    def size(self, number: int) -> tuple[float, float]:
        """Return length and width [m] of an entity."""
        self._functions.SE_GetObjectState(number, ctypes.byref(self._state))
        return self._state.length, self._state.width

    def report(
        self, number: int, x: float, y: float, h: float, v: float, a: float, turn: float
    ) -> None:
        """Set the state of an entity that is driven from outside.

        Args:
            number: its own.
            x: [m] of its reference point.
            y: [m].
            h: heading [rad].
            v: speed [m/s].
            a: acceleration along its heading [m/s²].
            turn: rate of its heading [rad/s].
        """
        call, cos, sin = self._functions, elementary.cos(h), elementary.sin(h)
        call.SE_ReportObjectPosXYH(number, x, y, h)
        call.SE_ReportObjectSpeed(number, v)
        call.SE_ReportObjectVel(number, v * cos, v * sin, 0.0)
        call.SE_ReportObjectAcc(number, a * cos - v * turn * sin, a * sin + v * turn * cos, 0.0)
