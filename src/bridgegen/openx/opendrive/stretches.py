"""The stretches of road of a map that a scenario of a road can take place on.

A stretch begins at the start of a road, or where driving lanes begin or end along it, and leads in
one direction of travel as long as the same lanes lead on. It is called by the road's id; where it
begins further along, with the number of its first lane section (``12.2``); against the road's
reference line with ``-back`` (``12-back``, ``12.2-back``).
"""

import math
from collections.abc import Iterator

from bridgegen.openx.opendrive.chains import Run, chain, runs
from bridgegen.openx.opendrive.geometry import reference_pose
from bridgegen.openx.opendrive.legs import leads_to
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.site import map_stem
from bridgegen.scenario.ontology.site import Leg, Site

SHORTEST = 20.0
"""Shorter stretches are left out [m]: the shortest road of a scenario file."""

MAIN = "main"
"""What the only leg of a scenario of a road is called."""


def stretches(model: OpenDrive, map_name: str | None = None) -> Iterator[Site]:
    """Yield every stretch of a map, in the order of the file, junctions left out.

    Args:
        model: the road network.
        map_name: the map's file name, as in ``Town05.xodr``.
    """
    name = map_stem(model, map_name)
    for road in model.roads:
        if road.is_connecting:
            continue
        for run in runs(road):
            lanes = [road.sections[run.sections[0]].lane(one) for one in run.ids]
            for end in ("start", "end"):
                if all(lane is None or leads_to(road, lane, end) for lane in lanes):
                    continue  # all traffic comes towards one
                roads = tuple(chain(model, run, end, meets=False))
                leg = Leg(MAIN, _heading(run, end), roads)
                if leg.length >= SHORTEST:
                    yield Site(name, map_name, _id(run, end), None, (leg,), kind=None)


def _id(run: Run, end: str) -> str:
    """Return what a stretch is called."""
    part = f".{run.sections[0]}" if run.sections[0] else ""
    return f"{run.road.id}{part}{'' if end == 'start' else '-back'}"


def _heading(run: Run, end: str) -> float:
    """Return the direction of travel at the beginning of a stretch [deg], in [0, 360)."""
    forward = end == "start"
    h = math.degrees(reference_pose(run.road, run.low if forward else run.high).h)
    return (h if forward else h + 180.0) % 360.0
