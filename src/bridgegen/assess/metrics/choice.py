"""Which metrics exist: for example no mean IoU with a driver that does not perceive."""

from collections.abc import Collection, Sequence

from bridgegen.assess.metrics.metric import Need
from bridgegen.assess.metrics.registry import TABLE_I, get
from bridgegen.base.errors import InputError
from bridgegen.drivers import DRIVERS, Driver


def held_by(driver: Driver, *, detects: bool = False) -> tuple[Need, ...]:
    """Return what a simulator's rollouts of a driver hold besides motion.

    Args:
        driver: of the ego.
        detects: whether a detector records detections, whatever the driver.
    """
    perceives = detects or driver.perceives
    return ("detections", "lights", "offset") if perceives else ("lights", "offset")


def existing(names: Sequence[str], held: Collection[Need]) -> tuple[str, ...]:
    """Return those of the named metrics that exist where rollouts hold ``held``.

    Raises:
        UnknownNameError: a name is not a metric's.
    """
    return tuple(name for name in names if get(name).needs in (None, *held))


def require(names: Sequence[str], held: Collection[Need], source: str) -> tuple[str, ...]:
    """Return the names, all of which must exist where rollouts hold ``held``.

    Args:
        names: of metrics.
        held: what the rollouts hold.
        source: of the rollouts, for the message.

    Raises:
        UnknownNameError: a name is not a metric's.
        InputError: those that do not exist there, all at once.
    """
    perceive = ", ".join(one.name for one in DRIVERS.values() if one.perceives)
    hints = {"detections": f"; drivers that perceive (--ego): {perceive}" if perceive else ""}
    needs = {name: get(name).needs for name in names}
    problems = [
        f"the metric '{name}' needs {need}, and {source} has none{hints.get(need, '')}"
        for name, need in needs.items()
        if need is not None and need not in held
    ]
    if problems:
        raise InputError(*problems)
    return tuple(names)


def to_record(driver: Driver, asked: Sequence[str], *, detects: bool = False) -> tuple[str, ...]:
    """Return what a search records: Table I's metrics, as far as they exist, and requested ones.

    Others are recorded only on request: together they take longer than the paper's.

    Raises:
        UnknownNameError: a name is not a metric's.
        InputError: a requested one does not exist with this driver.
    """
    held = held_by(driver, detects=detects)
    chosen = require(asked, held, f"the driver '{driver.name}'")
    return tuple(dict.fromkeys((*existing(TABLE_I, held), *chosen)))
