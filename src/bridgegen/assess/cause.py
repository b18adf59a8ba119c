"""The quick cause of a critical scenario: it is replayed with one stage corrected at a time.

The first of these that makes the scenario uncritical is the cause:

1. *perception*: the driver perceives ideally;
2. *vehicle dynamics*: the vehicle is kinematic: it goes where it is steered, at once;
3. *planning*: a careful and competent driver drives, who perceives ideally, too: that of UN R157
   or of the fuzzy safety model, each extended to any road (`careful`, `careful-fsm`);
4. *control*: the driver's control is ideal, or the road is dry;
5. *unavoidable*: none of them.

Everything else is the same, the random numbers included, which depend on the parameters' values
alone. A driver without one of these stages, or with one that is ideal already, skips its replay:
the route follower perceives nothing, so where a careful driver avoids harm, its cause is planning.
Prediction is a part of planning: the careful drivers have their own. A vehicle that
is kinematic already skips its replay. Dynamics come before planning: the same driver copes with the
kinematic vehicle, so what it lacks is knowledge of the other one; a careful driver, who keeps room
for more, copes with most vehicles, and would hide them.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import numpy.typing as npt

from bridgegen import drivers as egos
from bridgegen.base.arrays import Bool, Int
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.drivers import Driver
from bridgegen.simulation.vehicles import KINEMATIC

CAREFUL = ("careful", "careful-fsm")
"""The careful and competent drivers; either is enough."""


class Cause(IntEnum):
    """What a critical scenario's harm is put down to; NONE of one that is not critical."""

    NONE = 0
    PERCEPTION = 1
    PLANNING = 2
    CONTROL = 3
    UNAVOIDABLE = 4
    VEHICLE_DYNAMICS = 5  # numbers are kept in pages, so a later one comes last

    @property
    def label(self) -> str:
        """What people and files call it; empty for NONE."""
        return self.name.lower().replace("_", " ") if self else ""

    @classmethod
    def named(cls, label: str) -> "Cause":
        """Return the cause of that label, not NONE.

        Raises:
            UnknownNameError: there is none.
        """
        for cause in CAUSES:
            if cause.label == label:
                return cause
        raise UnknownNameError("cause", label, [cause.label for cause in CAUSES])


CAUSES = (
    Cause.PERCEPTION,
    Cause.VEHICLE_DYNAMICS,
    Cause.PLANNING,
    Cause.CONTROL,
    Cause.UNAVOIDABLE,
)
"""Root causes in the order in which they are sought."""


@dataclass(frozen=True)
class Counterfactual:
    """A replay with one thing put right.

    Attributes:
        cause: what the harm is put down to if it is gone.
        driver: who drives.
        dry: whether the road is dry.
        kinematic: whether the ego's vehicle is.
    """

    cause: Cause
    driver: Driver
    dry: bool = False
    kinematic: bool = False


def counterfactuals(driver: Driver, vehicle: str = KINEMATIC) -> tuple[Counterfactual, ...]:
    """Return the replays that determine the cause of a driver's harm, in their order.

    None where the file's own actions move the ego: it has no driver.

    Args:
        driver: of the ego.
        vehicle: how the ego moves, see `bridgegen.simulation.vehicles`.
    """
    if driver == egos.STORYBOARD:
        return ()

    def ideal(stage: str) -> list[Driver]:
        if stage not in driver.stages - driver.ideal:
            return []
        return [driver.idealised(driver.ideal | {stage})]

    # One change at a time: a driver that does not look, on ice, has an unavoidable crash, because
    # neither perception alone nor grip alone avoids it.
    dynamics = vehicle != KINEMATIC
    others = [egos.get(name) for name in CAREFUL if name != driver.name]
    return (
        *(Counterfactual(Cause.PERCEPTION, item) for item in ideal("perception")),
        *([Counterfactual(Cause.VEHICLE_DYNAMICS, driver, kinematic=True)] if dynamics else []),
        *(Counterfactual(Cause.PLANNING, other) for other in others),
        *(Counterfactual(Cause.CONTROL, item) for item in ideal("control")),
        Counterfactual(Cause.CONTROL, driver, dry=True),
    )


def require(cause: Cause, driver: Driver, vehicle: str = KINEMATIC) -> None:
    """Check that a driver's harm can have a cause, in some vehicle.

    Raises:
        InputError: it cannot: the stage is ideal, or missing; or the ego has no driver.
    """
    replays = counterfactuals(driver, vehicle)
    known = [item for item in CAUSES if item in {replay.cause for replay in replays}]
    if not replays:
        raise InputError(
            f"cause '{cause.label}': the ego has no driver, the file's own actions move it"
        )
    if cause not in (*known, Cause.UNAVOIDABLE):
        others = ", ".join(item.label for item in (*known, Cause.UNAVOIDABLE))
        raise InputError(
            f"cause '{cause.label}': no harm of the driver '{driver.label}' in a vehicle that is "
            f"{vehicle} can have it, only {others}"
        )


def causes(
    replays: Sequence[Counterfactual],
    critical: Bool,
    harmless: Callable[[Int, Counterfactual], Bool],
) -> npt.NDArray[np.int8]:
    """Return the cause of each row's harm; NONE of an uncritical row, and without replays.

    Only rows without a cause so far are replayed; a row's cause depends on that row alone.

    Args:
        replays: see `counterfactuals`.
        critical: ``(N,)`` bool.
        harmless: replays the rows at some positions, and says which succeed and are not critical
            then.

    Returns:
        ``(N,)`` int8, a `Cause` each.
    """
    found = np.full(len(critical), Cause.NONE, dtype=np.int8)
    # Only what is still unexplained is replayed: 400 rows cost 1.0 to 2.0 times as much where few
    # are critical.
    left = np.flatnonzero(critical)
    for replay in replays:
        if not len(left):
            return found
        gone = harmless(left, replay)
        found[left[gone]] = replay.cause
        left = left[~gone]
    if replays:
        found[left] = Cause.UNAVOIDABLE
    return found
