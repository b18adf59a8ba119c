"""What a file's properties declare: the time step, the ego's driver, the key of its noise."""

from bridgegen.ego import DRIVERS, GUESTS, STORYBOARD, Driver, is_spec, split
from bridgegen.errors import InputError, UnsupportedError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.declarations import (
    DEFAULT_TIME_STEP,
    DRIVER,
    IDEAL,
    NOISE_KEY,
    TIME_STEP,
)
from bridgegen.simulation.embedded.compiler.controllers import Controllers

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


def driver(controllers: Controllers, place: str) -> Driver:
    """Return the driver that the ego's controllers name; the storyboard, if none does."""
    for controller in controllers.of_ego():
        properties = controller.properties
        name = properties.get(DRIVER) if properties else None
        if name is not None:
            if is_spec(str(name)):
                raise UnsupportedError(
                    f"{place}, line {controller.line}: the ego is driven by '{name}', "
                    f"which is code; to run it, name it: --ego {name}"
                )
            known = DRIVERS | GUESTS
            if str(name) not in known:
                raise UnsupportedError(
                    f"{place}, line {controller.line}: unknown ego driver '{name}'; "
                    f"known: {', '.join(DRIVERS)} (choose one with --ego)"
                )
            stages = split(str(properties.get(IDEAL) or "")) if properties else ()
            try:
                return known[str(name)].idealised(stages)
            except InputError as error:
                raise InputError(
                    f"{place}, line {controller.line}: property {IDEAL}: {error}"
                ) from None
    return STORYBOARD


def noise_key(controllers: Controllers, place: str) -> int | None:
    """Return the key of the ego's random numbers that its controllers name, if one does."""
    for controller in controllers.of_ego():
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
