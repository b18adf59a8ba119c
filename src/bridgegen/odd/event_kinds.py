"""The kinds of events that are found in recorded traffic, and the quantities that each has.

`bridgegen.mining.events` has a detector per kind. Gaps are from bumper to bumper along the lane,
speeds along the lane; a relative speed is positive where the ego comes nearer. A quantity is NaN
where its event has none, such as the speed of a next vehicle where nothing is in sight.

Events of paths that cross need no lanes. Their distances are along the paths, between the centres
of the bodies and the point at which the paths cross.
"""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class EventQuantity:
    """A quantity of an event.

    Attributes:
        name: as expressions name it.
        unit: one of `bridgegen.odd.parameters.UNITS`.
        description: what it is.
    """

    name: str
    unit: str
    description: str


@dataclass(frozen=True)
class EventKind:
    """A kind of event.

    Attributes:
        name: as scenario files name it.
        roles: of the participants besides the ego.
        rule: what counts as one.
        source: of the rule.
        quantities: by name.
        needs_lanes: whether only driving on lanes can hold one.
    """

    name: str
    roles: tuple[str, ...]
    rule: str
    source: str
    quantities: Mapping[str, EventQuantity]
    needs_lanes: bool = True


def _kind(
    name: str,
    roles: tuple[str, ...],
    rule: str,
    source: str,
    rows: tuple[tuple[str, str, str], ...],
    needs_lanes: bool = True,
) -> EventKind:
    quantities = {row[0]: EventQuantity(*row) for row in rows}
    return EventKind(name, roles, rule, source, quantities, needs_lanes)


_EGO = ("ego_speed", "m/s", "speed of the ego at the beginning")
_LEAD_TIME = (
    "lead_time", "s", "how long the ego has had this leader before, at most 30 s",
)  # fmt: skip
_WIDTH = ("lane_width", "m", "width of the ego's lane at the beginning")
_CHANGE = (
    ("change_time", "s", "duration of the sinusoidal lane change that fits best"),
    ("lateral_speed", "m/s", "width of the lane change by its duration"),
    ("side", "1", "1 if it moves to the right, -1 if to the left"),
)

_MEETING = (
    _EGO,
    ("other_speed", "m/s", "speed of the other at the beginning"),
    ("ego_distance", "m", "from the ego to the crossing point at the beginning"),
    ("other_distance", "m", "from the other to the crossing point at the beginning"),
    ("ego_crossing_speed", "m/s", "speed of the ego at the crossing point"),
    ("other_crossing_speed", "m/s", "speed of the other at the crossing point"),
    ("time_gap", "s", "between the instants at which their centres pass the crossing point"),
    (
        "pet",
        "s",
        "post-encroachment time: least time between instants at which both bodies cover a point",
    ),
    ("angle", "deg", "between their courses at the crossing point, 0 to 180"),
    ("approach_angle", "deg", "between their courses 30 m of path before, 0 to 180"),
    ("side", "1", "1 if the other comes from the right, -1 from the left"),
    ("seen_time", "s", "from the beginning until the first of both passes the crossing point"),
    ("set_off_distance", "m", "from the other to the crossing point when it sets off last"),
    ("set_off_ego_distance", "m", "from the ego to the crossing point then, negative beyond it"),
    ("set_off_apart", "m", "between the reference points of both then"),
)
_EGO_FIRST = ("ego_first", "1", "1 if the ego passes the crossing point first, else 0")
_MEETING_RULE = (
    "The centres of both pass the point at which their paths cross within 6 s. It begins 6 s "
    "before the first of both passes, or when both are recorded, if that is later; it ends when "
    "the second passes."
)
_MEETING_SOURCE = (
    "NHTSA, Pre-Crash Scenario Typology (DOT HS 810 767), {}; Allen, Shin, Cooper, Transportation "
    "Research Record 667 (1978) 67-74 (post-encroachment time); the thresholds are ours"
)

_CHANGE_RULE = "the lane change is the half wave of a cosine that fits its rear axle best"

EVENT_KINDS = {
    one.name: one
    for one in (
        _kind(
            "cut-in",
            ("other",),
            "A vehicle changes into the ego's lane, and when its centre crosses the line the ego "
            "is the first behind it, at most 150 m. The ego keeps its lane. It begins with the "
            f"lane change; {_CHANGE_RULE}.",
            "UN R157, Annex 4, Appendix 3; de Gelder et al., IEEE ITSC 2020, doi:10.1109/"
            "ITSC45102.2020.9294222",
            (
                _EGO,
                ("other_speed", "m/s", "speed of the other at the beginning"),
                ("relative_speed", "m/s", "ego_speed less other_speed"),
                ("gap", "m", "at the beginning; negative where they are side by side"),
                ("crossing_gap", "m", "when the other's centre crosses the line"),
                ("lateral_distance", "m", "between the centres across the lane at the beginning"),
                *_CHANGE,
                _WIDTH,
                ("lead_time", "s", "how long both are recorded before, at most 30 s"),
            ),
        ),
        _kind(
            "cut-out",
            ("lead", "revealed"),
            "The ego's leader changes to a lane beside it, and the ego keeps its lane. Revealed is "
            "the ego's next leader when the centre of the first crosses the line. It begins with "
            "the lane change.",
            "UN R157, Annex 4, Appendix 3; de Gelder et al., IEEE ITSC 2020, doi:10.1109/"
            "ITSC45102.2020.9294222",
            (
                _EGO,
                ("lead_speed", "m/s", "speed of the leader at the beginning"),
                ("gap", "m", "from the ego to the leader at the beginning"),
                ("revealed_speed", "m/s", "speed of the revealed vehicle at the beginning"),
                ("revealed_gap", "m", "from the leader to the revealed vehicle at the beginning"),
                *_CHANGE,
                _WIDTH,
                _LEAD_TIME,
            ),
        ),
        _kind(
            "lead-brakes",
            ("lead", "next"),
            "The ego's leader, in the same lane as the ego, slows down by 2 m/s or more, at 2 m/s² "
            "or more: a ramp of its speed that fits best. It is the leader from the beginning to "
            "the end of the ramp. Next is the leader's own leader.",
            "UN R157, Annex 4, Appendix 3 (deceleration); the thresholds are ours",
            (
                _EGO,
                ("lead_speed", "m/s", "speed of the leader before it brakes"),
                ("relative_speed", "m/s", "ego_speed less lead_speed"),
                ("gap", "m", "at the beginning"),
                ("deceleration", "m/s²", "slope of the ramp"),
                ("low_speed", "m/s", "speed of the leader at the end of the ramp"),
                ("next_speed", "m/s", "speed of the next vehicle at the beginning"),
                ("next_gap", "m", "from the leader to the next vehicle at the beginning"),
                ("queue_gap", "m", "from the next vehicle to the one ahead of it"),
                _WIDTH,
                _LEAD_TIME,
            ),
        ),
        _kind(
            "approach",
            ("lead",),
            "The ego is faster than its leader by 2 m/s or more, and the time to collision is at "
            "most 10 s, for 0.5 s or more; the leader brakes and accelerates by at most 1 m/s² at "
            "the beginning.",
            "NHTSA, Pre-Crash Scenario Typology (DOT HS 810 767), lead vehicle stopped, lead "
            "vehicle moving at lower constant speed; the thresholds are ours",
            (
                _EGO,
                ("lead_speed", "m/s", "speed of the leader at the beginning"),
                ("relative_speed", "m/s", "ego_speed less lead_speed"),
                ("gap", "m", "at the beginning"),
                ("lead_offset", "m", "of the leader's centre from the middle of the lane, left "
                 "positive"),
                _WIDTH,
                _LEAD_TIME,
            ),
        ),
        _kind(
            "following",
            ("lead",),
            "The ego has the same leader for 3 s or more, at a time headway of at most 4 s, drives "
            "at 1 m/s or more, and their speeds differ by at most 2 m/s.",
            "Brackstone and McDonald, Transportation Research Part F 2 (1999) 181-196, on car "
            "following; the thresholds are ours",
            (
                ("ego_speed", "m/s", "mean speed of the ego"),
                ("lead_speed", "m/s", "mean speed of the leader"),
                ("gap", "m", "mean"),
                ("headway", "s", "gap by speed of the ego, mean"),
                ("least_headway", "s", "smallest"),
                ("following_time", "s", "how long it lasts"),
                _WIDTH,
            ),
        ),
        _kind(
            "lane-change",
            ("lead", "new_lead", "follower"),
            "The ego changes lane. Leader is whoever was ahead in the old lane; new leader and "
            "follower are those of the new lane when the centre crosses the line. An overtaking is "
            "one with a passing_time.",
            "Toledo and Zohar, Transportation Research Record 1999 (2007) 71-78",
            (
                _EGO,
                ("lead_speed", "m/s", "speed of the leader at the beginning"),
                ("gap", "m", "to the leader at the beginning"),
                ("new_lead_speed", "m/s", "speed of the new leader at the crossing"),
                ("new_lead_gap", "m", "to the new leader at the crossing"),
                ("follower_speed", "m/s", "speed of the follower at the crossing"),
                ("follower_gap", "m", "from the follower to the ego at the crossing"),
                *_CHANGE,
                _WIDTH,
                ("passing_time", "s", "from the beginning until the ego is level with the leader "
                 "of the old lane"),
            ),
        ),
        _kind(
            "crossing",
            ("other",),
            "The path of another motor vehicle crosses the ego's at 30° to 150°. The ego goes "
            "straight on: it turns by 30° at most from 30 m before to 15 m after. They do not come "
            f"from opposite directions. {_MEETING_RULE}",
            _MEETING_SOURCE.format("straight crossing paths, left turn across path from a side"),
            (
                *_MEETING, _EGO_FIRST,
                ("other_turn", "deg", "by how much the other turns, to the left positive"),
            ),
            needs_lanes=False,
        ),
        _kind(
            "oncoming-left-turn",
            ("other",),
            "The ego and another motor vehicle come from opposite directions: their courses 30 m "
            "before are 145° apart or more. One of them turns by more than 20° across the path of "
            "the other, which goes straight on. Where traffic drives on the left that is a right "
            f"turn. {_MEETING_RULE}",
            _MEETING_SOURCE.format("left turn across path from opposite directions"),
            (
                *_MEETING, _EGO_FIRST,
                ("ego_turns", "1", "1 if the ego turns, 0 if the other does"),
                ("turn", "deg", "by how much the one turns that does"),
            ),
            needs_lanes=False,
        ),
        _kind(
            "vru-crossing",
            ("other", "occluder"),
            "A pedestrian crosses the ego's path at 45° to 135°, or a bicycle at 20° to 160°, "
            f"before the ego comes. {_MEETING_RULE} It is hidden if a vehicle that stands is on "
            "the line from the ego's front to its centre within the last 2 s before it crosses.",
            _MEETING_SOURCE.format("pedestrian crossing the roadway, pedalcyclist"),
            (
                *_MEETING,
                ("ego_turn", "deg", "by how much the ego turns, to the left positive"),
                ("is_bicycle", "1", "1 for a bicycle, 0 for a pedestrian"),
                ("hidden", "1", "1 if it is hidden, else 0"),
                ("occluder_gap", "m", "along the ego's course, from the crossing point to the "
                 "nearest end of what hides it"),
            ),
            needs_lanes=False,
        ),
    )
}  # fmt: skip
"""By name."""
