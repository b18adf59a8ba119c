"""Roads as legs of a junction: which way their lanes lead, and where they go from there."""

import math

from bridgegen.openx.opendrive.furniture import Signal, SignalReference
from bridgegen.openx.opendrive.geometry import reference_pose
from bridgegen.openx.opendrive.model import CONTACTS, Lane, Road


def leads_to(road: Road, lane: Lane, end: str) -> bool:
    """Return whether traffic on a lane leaves its road at this end, ``"start"`` or ``"end"``."""
    return (road.direction(lane.id) > 0) == (end == "end")


def heading(road: Road, end: str) -> float:
    """Return the direction in which a road leads away from its end [deg], in [0, 360)."""
    h = reference_pose(road, 0.0 if end == "start" else road.length).h
    return math.degrees(h + (0.0 if end == "start" else math.pi)) % 360.0


def junction_end(road: Road) -> str:
    """Return which ends of a road touch a junction: start, end, both or none."""
    ends = [
        end
        for end in CONTACTS
        if (link := road.link(end)) is not None and link.element_type == "junction"
    ]
    return "both" if len(ends) == 2 else ends[0] if ends else "none"


def governs(road: Road, signal: Signal | SignalReference, lane_id: int) -> bool:
    """Return whether a signal is for the traffic of a lane."""
    if signal.validity:
        return any(
            validity.from_lane <= lane_id <= validity.to_lane for validity in signal.validity
        )
    way = {"+": 1, "-": -1}.get(signal.orientation)
    return way in (None, road.direction(lane_id))


def signals_on(road: Road) -> tuple[Signal | SignalReference, ...]:
    """Return the signals that stand on a road, and those of other roads that hold on it."""
    return (*road.signals, *road.signal_references)
