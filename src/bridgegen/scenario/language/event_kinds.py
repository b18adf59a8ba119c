"""The kinds of events that are found in recorded traffic, and the quantities that each has.

`bridgegen.recordings.events` has a detector per kind. Gaps are from bumper to bumper along the
lane, speeds along the lane; a relative speed is positive where the ego comes nearer. A quantity is
NaN where its event has none, such as the speed of a next vehicle where nothing is in sight.
"""

from bridgegen.scenario.language.event_kind import EventKind, EventQuantity
from bridgegen.scenario.language.lane_event_kinds import LANE_KINDS
from bridgegen.scenario.language.path_event_kinds import PATH_KINDS

__all__ = ["EVENT_KINDS", "EventKind", "EventQuantity"]

EVENT_KINDS = {kind.name: kind for kind in (*LANE_KINDS, *PATH_KINDS)}
"""Kinds of recorded events by name."""
