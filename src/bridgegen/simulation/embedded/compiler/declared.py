"""Declarations in a file's properties: time step, drivers, the ego's vehicle and its noise."""

import math
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import numpy as np

from bridgegen.base.arrays import Int
from bridgegen.base.errors import InputError, UnknownNameError, UnsupportedError
from bridgegen.drivers import DRIVERS, GUESTS, STORYBOARD, Driver, get, is_planner, is_spec, split
from bridgegen.drivers import _tracking_kernels as tracking
from bridgegen.drivers.drivers import CODES, manoeuvre_of
from bridgegen.drivers.kinds import NAMES
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.declarations import (
    DEFAULT_TIME_STEP,
    DRIVER,
    GHOST,
    IDEAL,
    NOISE_KEY,
    ROAD_END,
    STAND,
    TIME_STEP,
    TRACKER,
    VEHICLE,
)
from bridgegen.openx.openscenario.element import Element
from bridgegen.openx.openscenario.parameters import kind_of
from bridgegen.openx.openscenario.values import Kind, Value
from bridgegen.scenario.language.story import GHOST_UNITS, TRACKER_UNITS
from bridgegen.scenario.participants import PARTICIPANTS
from bridgegen.simulation.embedded import _codes as codes
from bridgegen.simulation.embedded.compiler.controllers import Controllers
from bridgegen.simulation.embedded.compiler.tables import Tables, table
from bridgegen.simulation.vehicles import KINEMATIC, require

LEAST_STEP, MOST_STEP = 1e-4, 1.0  # s


def time_step(scenario: osc.OpenScenario, place: str, asked: float | None) -> float:
    """Return the time step that is asked for, or else the header's, or the usual one [s]."""
    value, shown = asked, f"{asked:g}" if asked is not None else ""
    if asked is None:
        properties = scenario.file_header.properties
        text = properties.get(TIME_STEP) if properties else None
        if text is None:
            return DEFAULT_TIME_STEP
        value, shown = _number(str(text)), f"'{text}' (FileHeader)"
    if value is None or not LEAST_STEP <= value <= MOST_STEP:
        raise InputError(
            f"{place}: {LEAST_STEP:g} <= time_step <= {MOST_STEP:g} [s] must hold, got {shown}"
        )
    return value


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def stands(scenario: osc.OpenScenario, place: str) -> bool:
    """Return whether bodies stand where their road ends, instead of leaving.

    Raises:
        InputError: the header's property has another value.
    """
    properties = scenario.file_header.properties
    value = properties.get(ROAD_END) if properties else None
    if value is not None and str(value) != STAND:
        raise InputError(f"{place}: {ROAD_END} (FileHeader) must be '{STAND}', got '{value}'")
    return value is not None


def driver(controllers: Controllers, place: str) -> Driver:
    """Return the driver that the ego's controllers name; the storyboard, if none does.

    Raises:
        UnsupportedError: it is unknown, or the user's own; or there are two.
        InputError: stages that it has not, or a planner that is not installed.
    """
    _refuse_two(controllers, place)
    for controller in controllers.of(0):
        properties = controller.properties
        name = properties.get(DRIVER) if properties else None
        if name is not None:
            # A file from another person may name ``os:system``. Only what is typed runs code.
            if is_spec(str(name)):
                raise UnsupportedError(
                    f"{place}, line {controller.line}: the ego is driven by '{name}', "
                    f"which is code; to run it, name it: --ego {shlex.quote(str(name))}"
                )
            plain = str(name).removesuffix(manoeuvre_of(str(name)))
            if str(name) not in GUESTS and plain not in DRIVERS and not is_planner(str(name)):
                raise UnsupportedError(
                    f"{place}, line {controller.line}: unknown ego driver '{name}'; "
                    f"known: {', '.join(DRIVERS)} (choose one with --ego)"
                )
            stages = split(str(properties.get(IDEAL) or "")) if properties else ()
            found = get(str(name))
            try:
                return found.idealised(stages)
            except InputError as error:
                raise InputError(
                    f"{place}, line {controller.line}: property {IDEAL}: {error}"
                ) from None
    return STORYBOARD


def _refuse_two(controllers: Controllers, place: str) -> None:
    """Refuse an ego whose controllers name two drivers."""
    found = None
    for controller in controllers.of(0):
        value = controller.properties.get(DRIVER) if controller.properties else None
        if found is not None and value is not None and str(value) != found:
            raise UnsupportedError(
                f"{place}, line {controller.line}: the ego has two drivers, '{found}' and "
                f"'{value}' (choose one with --ego)"
            )
        found = found if value is None else str(value)


def other_driver(controllers: Controllers, place: str, entity: int, name: str) -> str | None:
    """Return the driver that an entity's controllers name, None if none does.

    Raises:
        UnsupportedError: it is no driver of participants other than the ego, or there are two.
    """
    found: dict[str, osc.Controller] = {}
    for controller in controllers.of(entity):
        value = controller.properties.get(DRIVER) if controller.properties else None
        if value is None:
            continue
        where = f"{place}, line {controller.line}: "
        if str(value) not in CODES:
            known = ", ".join(CODES)
            what = f"unknown driver '{value}' of '{name}'"
            if str(value) in DRIVERS | GUESTS or is_spec(str(value)) or is_planner(str(value)):
                what = f"the driver '{value}' is for the ego, not for '{name}'"
            raise UnsupportedError(f"{where}{what}; drivers of other participants: {known}")
        if found and str(value) not in found:
            raise UnsupportedError(
                f"{where}'{name}' has two drivers, '{next(iter(found))}' and '{value}'"
            )
        found[str(value)] = controller
    if not found:
        return None
    return next(iter(found))


def vehicle(controllers: Controllers, place: str, asked: str | None, *, has_driver: bool) -> str:
    """Return how the ego moves: as asked for, or as its controllers say, or kinematically.

    Raises:
        UnknownNameError: there is no such vehicle.
        InputError: dynamics are asked for, and the ego has no driver; or a file names no vehicle.
    """
    if asked is not None:
        require(asked)
        if asked != KINEMATIC and not has_driver:
            raise InputError(
                f"{place}: the vehicle '{asked}' needs a driver, and the file's own actions move "
                "the ego; name a driver (--ego)"
            )
        return asked
    for controller in controllers.of(0) if has_driver else ():
        properties = controller.properties
        text = properties.get(VEHICLE) if properties else None
        if text is not None:
            try:
                require(str(text))
            except UnknownNameError as error:
                raise InputError(
                    f"{place}, line {controller.line}: property {VEHICLE}: {error}"
                ) from None
            return str(text)
    return KINEMATIC


def noise_key(controllers: Controllers, place: str) -> int | None:
    """Return the key of the ego's random numbers that its controllers name, if one does."""
    for controller in controllers.of(0):
        properties = controller.properties
        text = properties.get(NOISE_KEY) if properties else None
        if text is not None:
            if not (str(text).isdecimal() and int(str(text)) < 2**64):
                raise InputError(
                    f"{place}, line {controller.line}: property {NOISE_KEY} must be a "
                    f"whole number from 0 to 2^64 - 1, got '{text}'"
                )
            return int(str(text))
    return None


def ghosts(controllers: Controllers, tables: Tables) -> Int:
    """Return `Program.ghosts`, which the ego's controllers name.

    Raises:
        InputError: a key that no ghost has, one that is missing, or a value that none may have.
    """
    said: dict[str, dict[str, osc.Property]] = {}
    for controller in controllers.of(0):
        for item in controller.properties.properties if controller.properties else ():
            prefix, _, rest = str(item.name).partition(".")
            if prefix == GHOST:
                name, _, word = rest.partition(".")
                said.setdefault(name, {})[word] = item
    rows = []
    for name, words in said.items():
        where = f"{tables.place}, line {next(iter(words.values())).line}: {GHOST}.{name}"
        has = words.keys()
        if not (
            {"type", "appears"} <= has <= {"type", "mirrors", *GHOST_UNITS}
            and len({"at", "rate", "mirrors"} & has) == 1
            and ("mirrors" in has) == ("aside" in has)
        ):
            raise InputError(
                f"{where} must have type, appears, and at, rate, or mirrors with aside; may have "
                f"vanishes, lifetime and share; got {', '.join(words)}"
            )
        whose = tables.text(words["mirrors"].value) if "mirrors" in words else None
        if whose is not None and whose not in tables.names[1:]:
            raise InputError(f"{where}.mirrors must name an entity, not the ego, got '{whose}'")
        said_type = tables.text(words["type"].value)
        if said_type not in PARTICIPANTS:
            known = ", ".join(PARTICIPANTS)
            raise InputError(f"{where}.type must be one of {known}, got '{said_type}'")
        usual = {"vanishes": 0.0, "lifetime": 60.0, "share": 1.0}
        slots = {word: tables.slot(value) for word, value in usual.items()}
        for word in (word for word in GHOST_UNITS if word in words):
            place = f"{where}.{word} [{GHOST_UNITS[word]}]"
            low = -math.inf if word == "aside" else 0.0
            slots[word] = _slot(tables, words[word].value, place, low)
        kind = PARTICIPANTS[said_type]
        size = tables.slot(kind.body.length), tables.slot(kind.body.width)
        what = NAMES.index(kind.seen_as.name)
        mirrors = -1 if whose is None else tables.names.index(whose)
        rows.append((*(slots.get(word, -1) for word in GHOST_UNITS), *size, what, mirrors))
    return table(rows, 11)


def tracker(controllers: Controllers, tables: Tables) -> Int:
    """Return `Program.tracker`; raise `InputError` as `ghosts` does."""
    found: dict[str, int] = {}
    for controller in controllers.of(0):
        for item in controller.properties.properties if controller.properties else ():
            prefix, _, word = str(item.name).partition(".")
            if prefix != TRACKER:
                continue
            where = f"{tables.place}, line {item.line}: {TRACKER}.{word}"
            if word not in TRACKER_UNITS:
                raise InputError(f"{where}: a tracker has {', '.join(TRACKER_UNITS)}")
            low = 1.0 if word in ("confirm", "of") else 0.0
            high = {"extent": 1.0, "of": float(tracking.MOST_FRAMES)}.get(word, math.inf)
            found[word] = _slot(tables, item.value, f"{where} [{TRACKER_UNITS[word]}]", low, high)
    usual = zip(TRACKER_UNITS, tracking.TRACKER, strict=True) if found else ()
    slots = [found.get(word, tables.slot(value)) for word, value in usual]
    return np.array(slots, dtype=np.int64)


def _slot(tables: Tables, text: Any, what: str, low: float, high: float = math.inf) -> int:
    """Return the slot of a property's value, a number or a parameter, from ``low`` to ``high``."""
    varies = isinstance(text, osc.ParameterRef) and text.name in tables.parameters
    value: Value | None = text if varies else _number(tables.text(text))
    number = math.nan if value is None else tables.declared(value)
    if value is None or not (low <= number <= high and math.isfinite(number)):
        rule = "" if low == -math.inf else f" of at least {low:g}"
        rule += f" and at most {high:g}" if high < math.inf else ""
        raise InputError(f"{what} must be a finite number{rule}, got '{text}'")
    return tables.slot(value)


# --- The elements of a storyboard in the order of the file ---


Part = osc.Story | osc.Act | osc.ManeuverGroup | osc.Maneuver | osc.Event | osc.Action

_KINDS = {
    osc.Story: codes.STORY,
    osc.Act: codes.ACT,
    osc.ManeuverGroup: codes.GROUP,
    osc.Maneuver: codes.MANEUVER,
    osc.Event: codes.EVENT,
    osc.Action: codes.ACTION,
}


@dataclass(frozen=True)
class Node:
    """An element of the storyboard: its place in the order of the file, its name and parents.

    Attributes:
        part: the element.
        kind: see ``_codes``.
        path: names from the story's to its own.
        parent: number of its parent; -1 of a story.
        end: number of the first element after it that is not in it.
    """

    part: Part
    kind: int
    path: tuple[str, ...]
    parent: int
    end: int


def nodes(storyboard: osc.Storyboard) -> list[Node]:
    """Return all elements in the order of the file, each before its children."""
    found: list[Node] = []
    for story in storyboard.stories:
        _append(found, story, (), -1)
    return found


def _append(found: list[Node], part: Part, path: tuple[str, ...], parent: int) -> None:
    number, path = len(found), (*path, str(part.name))
    kind = _KINDS[type(part)]
    found.append(Node(part, kind, path, parent, 0))
    for child in _children(part):
        _append(found, child, path, number)
    found[number] = Node(part, kind, path, parent, len(found))


def _children(part: Part) -> Sequence[Part]:
    match part:
        case osc.Story():
            return part.acts
        case osc.Act():
            return part.maneuver_groups
        case osc.ManeuverGroup():
            return part.maneuvers
        case osc.Maneuver():
            return part.events
        case osc.Event():
            return part.actions
    return ()


# --- Parameters and variables that change as the scenario runs, and dates, as numbers ---


EQUALITY = (codes.EQUAL, codes.NOT_EQUAL)


class Values:
    """The parameters and variables that conditions compare or actions set, numbered as they come.

    A text is a number of its own, a date the seconds since 1970, true is 1.

    Attributes:
        slots: of their first values.
    """

    def __init__(self, tables: Tables, scenario: osc.OpenScenario) -> None:
        self._tables = tables
        self._texts: dict[str, float] = {}
        self._numbers: dict[tuple[str, str], int] = {}
        self.slots: list[int] = []
        parameters, variables = scenario.parameter_declarations, scenario.variable_declarations
        self._declared: dict[tuple[str, str], tuple[Kind, Value]] = {}
        for parameter in parameters.parameters if parameters else ():
            kind = kind_of(parameter.parameter_type)
            first: Value = (
                osc.ParameterRef(f"${parameter.name}") if kind.is_number else parameter.value
            )
            self._declared["parameter", parameter.name] = kind, first
        for other in variables.variables if variables else ():
            kind = kind_of(other.variable_type)
            self._declared["variable", other.name] = kind, other.value

    def number(self, element: Element, what: str, name: str) -> int:
        """Return the number of a parameter or variable; one that is not declared is taken down."""
        key = (what, name)
        if key not in self._declared:
            self._tables.unsupported(element, f"{what} '{name}', which is not declared,")
            return 0
        if key not in self._numbers:
            kind, first = self._declared[key]
            value = first if isinstance(first, osc.ParameterRef) else self._read(kind, first)
            self._numbers[key] = len(self.slots)
            self.slots.append(self._tables.slot(value if value is not None else math.nan))
        return self._numbers[key]

    def value(self, element: Element, what: str, name: str, text: Value) -> Value:
        """Return what a text is as a value of a parameter or variable: a number, or its source."""
        kind, _ = self._declared.get((what, name), (Kind.STRING, ""))
        if self._is_number(text) and kind not in (Kind.STRING, Kind.DATE_TIME):
            return text
        value = self._read(kind, text)
        if value is None:
            what = f"value=\"{text}\" for {what} '{name}' ({kind.value})"
            self._tables.unsupported(element, what)
            return 0.0
        return value

    def is_ordered(self, what: str, name: str) -> bool:
        """Return whether values of a parameter or variable can be greater or less."""
        return self._declared.get((what, name), (Kind.STRING, ""))[0] is not Kind.STRING

    def _is_number(self, value: Value) -> bool:
        """Return whether a value is computed, or a number of the file's parameters."""
        if isinstance(value, osc.ParameterRef):
            return value.name in self._tables.parameters
        return isinstance(value, osc.Expr)

    def _read(self, kind: Kind, value: Value) -> float | None:
        text = self._tables.text(value) if isinstance(value, osc.ParameterRef) else str(value)
        if kind is Kind.STRING:
            return self._texts.setdefault(text, float(len(self._texts)))
        if kind is Kind.DATE_TIME:
            return seconds(text)
        if text in ("true", "false"):
            return float(text == "true")
        try:
            number = float(text)
        except ValueError:
            return None
        return number if math.isfinite(number) else None


def seconds(date: str) -> float | None:
    """Return a date's seconds since 1970, in UTC where it names no zone; None if it is none."""
    try:
        moment = datetime.fromisoformat(date)
    except ValueError:
        return None
    return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
