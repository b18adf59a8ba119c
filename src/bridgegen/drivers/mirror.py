"""What a driver in Python sees and answers where traffic drives on the left.

The simulator drives on the right, in a mirror: what a driver is given is mirrored, and so is what
it answers. Its own world has the coordinates and the lane ids of the files.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Float, opposite
from bridgegen.drivers.compiled import LANES
from bridgegen.drivers.interface import Lane, Light, Observation, RoadMap
from bridgegen.drivers.kinds import other_side
from bridgegen.drivers.trajectory import Plans

_TRACK = (2, 3, 5)
_LAMPS = 12
"""Columns of a track: y, heading and velocity in y; and its lamps."""

Views = dict[str, npt.NDArray[Any]]


def observation(seen: Observation) -> Observation:
    """Return an observation without views in the mirror."""
    return replace(
        seen,
        y=opposite(seen.y),
        h=opposite(seen.h),
        offset=opposite(seen.offset),
        route=opposite(seen.route, (1, 2, 3)),
        tracks=_tracks(seen.tracks),
    )


def views(found: Views) -> Views:
    """Return the views that complete an observation in the mirror; see `views.Views`."""
    found = dict(found)
    if "missed" in found:
        found["missed"] = _tracks(found["missed"])
    if "lanes" in found:
        found["lanes"] = _lanes(found["lanes"])
    return found


def answer(given: "tuple[Float, ...] | Plans") -> "tuple[Float, ...] | Plans":
    """Return what the driver answers in the mirror: a curvature, or trajectories."""
    if isinstance(given, Plans):
        return Plans(opposite(given.states, (2, 3)))
    acceleration, curvature, *demand = given
    return acceleration, opposite(curvature), *demand


def road_map(found: RoadMap) -> RoadMap:
    """Return a road network in the mirror."""
    return replace(
        found,
        lanes=tuple(map(_lane, found.lanes)),
        route=_names(found.route),
        crosswalks=tuple(opposite(each, (1,)) for each in found.crosswalks),
        lights=tuple(
            Light(light.id, _names(light.lanes), opposite(light.stop, (1,)))
            for light in found.lights
        ),
        pieces=opposite(found.pieces, (1, 2)),
    )


def _tracks(tracks: Float) -> Float:
    found = opposite(tracks, _TRACK)
    found[..., _LAMPS] = other_side(tracks[..., _LAMPS])
    return found


def _lanes(view: Float) -> Float:
    found = view.copy()
    lanes = found.view(LANES)[:, 0]
    lanes["beside"] = opposite(lanes["beside"][:, :, ::-1], (0,))
    lanes["goal"] = opposite(lanes["goal"], (1, 2))
    left, right = lanes["crosswalk"][:, 2].copy(), lanes["crosswalk"][:, 3].copy()
    is_there = np.isfinite(left)
    lanes["crosswalk"][:, 2] = np.where(is_there, 0.0 - right, left)
    lanes["crosswalk"][:, 3] = np.where(is_there, 0.0 - left, right)
    return found


def _lane(lane: Lane) -> Lane:
    sides: dict[str, Any] = {}
    for side, other in (("left", "right"), ("right", "left")):
        sides[side] = opposite(getattr(lane, other), (1,))
        sides[f"{side}_lane"] = _name(getattr(lane, f"{other}_lane"))
        for name in ("{}_is_same_way", "{}_marking", "may_change_{}"):
            sides[name.format(side)] = getattr(lane, name.format(other))
    return replace(
        lane,
        id=_name(lane.id),
        centre=opposite(lane.centre, (1, 2)),
        next=_names(lane.next),
        previous=_names(lane.previous),
        **sides,
    )


def _names(names: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(map(_name, names))


def _name(name: str) -> str:
    """Return ``road:section:lane`` with the other sign of the lane's id."""
    place, colon, lane = name.rpartition(":")
    return f"{place}{colon}{-int(lane)}" if lane else name
