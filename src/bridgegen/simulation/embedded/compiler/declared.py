"""Declarations in a file's properties: time step, drivers, the ego's vehicle and its noise."""

import shlex

from bridgegen.base.errors import InputError, UnknownNameError, UnsupportedError
from bridgegen.drivers import DRIVERS, GUESTS, STORYBOARD, Driver, get, is_planner, is_spec, split
from bridgegen.drivers.drivers import OTHERS
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.declarations import (
    DEFAULT_TIME_STEP,
    DRIVER,
    IDEAL,
    NOISE_KEY,
    ROAD_END,
    STAND,
    TIME_STEP,
    VEHICLE,
)
from bridgegen.simulation.embedded.compiler.controllers import Controllers
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
            if is_spec(str(name)):
                raise UnsupportedError(
                    f"{place}, line {controller.line}: the ego is driven by '{name}', "
                    f"which is code; to run it, name it: --ego {shlex.quote(str(name))}"
                )
            if str(name) not in DRIVERS | GUESTS and not is_planner(str(name)):
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
        if str(value) not in OTHERS:
            known = ", ".join(OTHERS)
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
