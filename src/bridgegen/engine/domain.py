"""The part of an operational design domain that a scenario needs, from its map and its actors."""

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.drivers import STORYBOARD, Driver
from bridgegen.drivers.planners import DOMAINS
from bridgegen.openx.opendrive.geometry import reference_pose
from bridgegen.openx.opendrive.model import OpenDrive, Road
from bridgegen.scenario.participants import PARTICIPANTS
from bridgegen.simulation.embedded.program import Program

if TYPE_CHECKING:
    from bridgegen.engine.runner import Runner

CROSSES = math.radians(45.0)
"""Difference of the directions of ways through a junction beyond which they cross or turn [rad];
those of a merge do not."""

AGAINST = math.radians(135.0)
"""Difference of its heading at the start from the ego's beyond which a participant is oncoming
[rad]."""

VULNERABLE = frozenset({"pedestrian", "bicycle"})
"""Conduct of vulnerable participants."""


def outside(runner: "Runner") -> str:
    """Return a sentence if the scenario says nothing of the ego's driver, which passes it; else "".

    The driver says that it is not made for it, or has none of its errors of perception. A driver
    for motorways may also follow a road on which there are lanes, but at first nobody, the other
    way.
    """
    driver, name = runner.driver, runner.scenario.name
    if why := unhaunted(driver, name, runner.embedded.program):
        return why
    return why_outside(driver, name, *needed_by(runner)) if driver.domain else ""


def unhaunted(driver: Driver, name: str, program: Program) -> str:
    """Return a sentence if a scenario has errors of perception that its driver lacks; else ""."""
    perceives = driver.perceives and "perception" not in driver.ideal
    stated = {"ghosts": program.ghosts, "late and merged tracks": program.tracker}
    errors = " and ".join(what for what, table in stated.items() if len(table))
    if driver == STORYBOARD or perceives or not errors:
        return ""
    return f"{driver.label} sees what is there, and so none of the {errors} of {name}"


def why_outside(driver: Driver, name: str, needs: frozenset[str], is_met: bool) -> str:
    """Return a sentence if a driver says that it is not made for a scenario; else "".

    Args:
        driver: of the ego.
        name: of the scenario.
        needs: what it needs, see `needed`.
        is_met: whether another starts against the ego's direction.
    """
    odd = needs - driver.domain
    if "motorway" in driver.domain and not is_met:
        odd -= {"road"}
    if not (driver.domain and odd):
        return ""
    there = " and ".join(what for word, what in DOMAINS.items() if word in odd)
    return f"outside the domain of {driver.name} ({in_words(driver.domain)}): {name} has {there}"


def needed_by(runner: "Runner") -> tuple[frozenset[str], bool]:
    """Return what the nominal scenario needs, and whether another starts against the ego.

    What it needs is of `DOMAINS`: one of "junction" (the ego's route leads through one in which
    ways cross or turn), "road" (there are opposite lanes) and "motorway"; "oncoming" if on the
    latter somebody drives against the ego's direction; and "vulnerable" if a pedestrian or a
    cyclist takes part.
    """
    nominal = runner.space.row({})[np.newaxis]
    # The row of the defaults may have a storyboard of its own, and roads by it.
    _, item = next(runner.by_variant(nominal))
    model = item.source.roads(item.space.values(nominal[0]))
    embedded = item.embedded
    roads = embedded.roads([model])
    columns = {name: x for name, x in item.columns(nominal).items() if name not in embedded.fixed}
    batch = embedded.batch(roads, np.zeros(1, np.int64), columns)
    batch.start()
    headings = batch.record.h[0, :, 0]
    kinds = [kind for text in runner.kinds.values() for kind in text.split(" or ")]
    against = against_ego(headings)
    return needed(model, roads.roads_ahead(0), headings, kinds), bool(against.any())


def needed(
    model: OpenDrive, ahead: Sequence[str], headings: Float, kinds: Iterable[str]
) -> frozenset[str]:
    """Return which of `DOMAINS` a concrete scenario needs.

    Args:
        model: its road network.
        ahead: ids of the roads of the ego's route.
        headings: ``(E,)`` [rad] at the start, the ego first.
        kinds: of the other participants, see `PARTICIPANTS`.
    """
    roads = {road.id: road for road in model.roads}
    own = [roads[name] for name in ahead]
    known = [PARTICIPANTS[kind] for kind in kinds if kind in PARTICIPANTS]
    beside = any(participant_kind.seen_as.conduct in VULNERABLE for participant_kind in known)
    needs = {"vulnerable"} if beside else set()
    if any(
        _crosses(model, junction)
        for junction in {road.junction for road in own if road.is_connecting}
    ):
        return frozenset(needs | {"junction"})
    if any(_has_opposite_lanes(road) for road in own):
        return frozenset(needs | {"road"})
    if against_ego(headings).any():
        needs.add("oncoming")
    return frozenset(needs | {"motorway"})


def in_words(domain: Iterable[str]) -> str:
    """Return words of `DOMAINS` in their order."""
    return ", ".join(word for word in DOMAINS if word in {*domain})


def _crosses(model: OpenDrive, junction: str) -> bool:
    """Return whether the ways through a junction cross or turn."""
    ends: list[float] = []
    for road in model.roads:
        if road.junction == junction:
            ends += [reference_pose(road, s).h for s in (0.0, road.length)]
            if _has_opposite_lanes(road):
                return True
    angles = np.array(ends)
    return bool((np.abs(_wrapped(angles[:, np.newaxis] - angles)) > CROSSES).any())


def against_ego(headings: Float) -> Bool:
    """Return which of the others start against the ego's direction, ``(E - 1,)``."""
    against: Bool = np.abs(_wrapped(headings[1:] - headings[0])) > AGAINST
    return against


def _has_opposite_lanes(road: Road) -> bool:
    ways = {
        road.direction(lane.id) for part in road.sections for lane in part.lanes if lane.drivable
    }
    return len(ways) > 1


def _wrapped(angle: Float) -> Float:
    wrapped: Float = (angle + math.pi) % (2.0 * math.pi) - math.pi
    return wrapped
