"""The drivers that ship, and how a scenario file names them."""

from dataclasses import dataclass

from bridgegen.errors import UnknownNameError


@dataclass(frozen=True)
class Driver:
    """A system under test that the embedded simulator can run.

    Attributes:
        name: as given to ``--ego`` and written to the file's Controller.
        code: which branch of the compiled rollout it is.
        description: one sentence.
    """

    name: str
    code: int
    description: str


ROUTE_FOLLOWER = Driver(
    "route-follower", 0, "Holds its target speed on its route and sees nobody (paper, Section V-A)."
)
REFERENCE = Driver(
    "reference",
    1,
    "Follows its route, slows for bends, keeps its distance, yields and brakes by predicted "
    "conflict; perceives perfectly.",
)
TRAJECTORY = Driver("trajectory", 0, "Nobody: the file's own timetable moves the ego.")
"""What an ego without a driver says it is driven by; not to be chosen."""

DRIVERS = {driver.name: driver for driver in (ROUTE_FOLLOWER, REFERENCE)}


def get(name: str) -> Driver:
    """Return a driver by name.

    Raises:
        UnknownNameError: no such driver.
    """
    try:
        return DRIVERS[name]
    except KeyError:
        raise UnknownNameError("ego driver", name, DRIVERS) from None
