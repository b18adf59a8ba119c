"""The small scenarios of `bridgegen.testing.storyboards`, run in the embedded simulator."""

from dataclasses import replace
from functools import cache

import numpy as np

from bridgegen.drivers import DRIVERS
from bridgegen.openx.opendrive.model import Header, OpenDrive
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.prepared import prepared
from bridgegen.simulation.embedded.simulator import EmbeddedSimulator
from bridgegen.simulation.rollout import Rollout
from bridgegen.testing.storyboards import (  # noqa: F401
    after,
    condition,
    crossroads,
    ended,
    event,
    events,
    friction,
    lane,
    lateral,
    near,
    reaches,
    scenario,
    speed_action,
    speeding,
    start,
    vehicle,
)

GLOBE = Header(1, 7, geo_reference="+proj=tmerc +lat_0=49 +lon_0=8 +datum=WGS84")


@cache
def _on_the_globe() -> OpenDrive:
    return replace(crossroads(), header=GLOBE)


def simulator(
    text: str, ego: str | None = "route-follower", others: str | None = None
) -> EmbeddedSimulator:
    driver = DRIVERS[ego] if ego else None
    file = prepared(read(text.encode(), "test.xosc"), _on_the_globe(), "test.xosc")
    return EmbeddedSimulator(file, "test.xosc", driver=driver, others=others)


def run(
    text: str,
    ego: str | None = "route-follower",
    roads: OpenDrive | None = None,
    others: str | None = None,
    **values: list[float],
) -> Rollout:
    made = simulator(text, ego, others)
    n = len(next(iter(values.values()))) if values else 1
    return made.run(made.roads([roads or crossroads()]), np.zeros(n, dtype=np.int64), values)
