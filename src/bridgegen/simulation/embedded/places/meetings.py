"""What attentive participants know of the map: where their paths meet others', lights and signs."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from bridgegen.base.arrays import Float, Int
from bridgegen.drivers.drivers import ATTENTIVE, LAWFUL
from bridgegen.drivers.kinds import IS_PEDESTRIAN
from bridgegen.drivers.scene import kerbs, stop_lines, stop_signs
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.simulation.embedded.places.ways import Ways
from bridgegen.simulation.embedded.program import Program


class Meetings(NamedTuple):
    """The same for all E participants of P road networks; without rows where nobody is attentive.

    Attributes:
        meets: ``(P, E)`` int64, whether there is anything in the following.
        meetings: ``(P, E, E, ZONE)`` where an attentive participant's first path meets each
            other's, see ``bridgegen.drivers._yielding_kernels``; infinite where it does not.
        lines: ``(P, E, S)`` [m], the stations of the stop lines of S lights on its path, else +inf;
            off the lanes, of the kerbs where the light is for the traffic that it crosses.
        signs: ``(P, E, H)`` [m], the stations of the lines of stop signs on it; off the lanes, of
            the kerbs from which it has no priority; +inf pads.
    """

    meets: Int
    meetings: Float
    lines: Float
    signs: Float


def meetings(program: Program, models: Sequence[OpenDrive], ways: Sequence[Ways]) -> Meetings:
    """Return what the attentive participants of a storyboard know of its road networks."""
    from bridgegen.drivers._yielding_kernels import ZONE  # numba is slow to import

    p, e, lights = len(models), len(program.names), len(program.lights)
    if not program.attends.size:
        return Meetings(
            np.zeros((p, 0), np.int64),
            np.zeros((p, 0, 0, ZONE)),
            np.zeros((p, 0, 0)),
            np.zeros((p, 0, 0)),
        )
    zones, lines = np.full((p, e, e, ZONE), np.inf), np.full((p, e, lights), np.inf)
    signs: dict[tuple[int, int], list[float]] = {}
    for number, (model, known) in enumerate(zip(models, ways, strict=True)):
        for item in np.flatnonzero(np.isin(program.others, (ATTENTIVE, LAWFUL))).tolist():
            _find_zones(zones[number, item], item, program, known)
            route = known.routes[item]
            if route is None:
                if program.others[item] == LAWFUL:
                    path = known.paths[item]
                    signs[number, item] = []
                    for kerb in reversed(kerbs(model, path.table, path.step, program.lights)):
                        for light in kerb.lights:
                            lines[number, item, program.lights.index(light)] = kerb.station
                        # On a crosswalk people on foot go first, not those who ride on it.
                        if not (kerb.crossing and IS_PEDESTRIAN[program.kinds[item]]):
                            signs[number, item].append(kerb.station)
                continue
            for line in reversed(stop_lines(model, route, program.lights)):
                lines[number, item, program.lights.index(line.light)] = line.station
            signs[number, item] = stop_signs(model, route)
    halts = np.full((p, e, max(map(len, signs.values()), default=0)), np.inf)
    for (number, item), stations in signs.items():
        halts[number, item, : len(stations)] = stations
    meets = np.isfinite(zones[..., 0]).any(axis=2).astype(np.int64)
    return Meetings(meets, zones, lines, halts)


def _find_zones(zones: Float, number: int, program: Program, ways: Ways) -> None:
    """Fill ``(E, ZONE)`` with where a participant's path meets the others'."""
    from bridgegen.drivers._yielding_kernels import (  # numba is slow to import
        ACROSS,
        HOW,
        OTHER_ENTERS,
        find_zone,
    )

    own, bodies = ways.paths[number], program.bodies
    for other in range(len(program.names)):
        path = ways.paths[other]
        if other == number or _follows(ways, number, other):
            continue
        find_zone(
            own.table,
            len(own.table),
            own.step,
            bodies[number],
            path.table,
            len(path.table),
            path.step,
            bodies[other],
            zones[other],
        )
        turning = ways.turnings.get(other) if other == 0 else None
        if turning is None:
            continue
        # Where the ego changes lanes, and that it will, nobody knows; nor that it comes this way.
        meets = turning.begins <= zones[other, OTHER_ENTERS] <= turning.returns + turning.back
        if zones[other, HOW] != ACROSS or (turning.against and meets):
            zones[other] = np.inf


def _follows(ways: Ways, number: int, other: int) -> bool:
    """Return whether two paths begin on the same lane: then the one behind follows the other."""
    a, b = ways.routes[number], ways.routes[other]
    if a is None or b is None:
        return False
    first, second = a.steps[0], b.steps[0]
    return (first.road_id, first.lane_id) == (second.road_id, second.lane_id)
