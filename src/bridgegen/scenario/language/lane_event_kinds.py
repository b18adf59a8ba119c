"""The kinds of events of vehicles on lanes."""

from bridgegen.scenario.language.event_kind import EGO_SPEED, event_kind

_LEAD_TIME = (
    "lead_time",
    "s",
    "how long the ego has had this leader before, at most 30 s",
)
_WIDTH = ("lane_width", "m", "width of the ego's lane at the beginning")
_CHANGE = (
    ("change_time", "s", "duration of the sinusoidal lane change that fits best"),
    ("lateral_speed", "m/s", "width of the lane change by its duration"),
    ("side", "1", "1 if it moves to the right, -1 if to the left"),
)

_CHANGE_RULE = "the lane change is the half wave of a cosine that fits its rear axle best"

LANE_KINDS = (
    event_kind(
        "cut-in",
        ("other",),
        "A vehicle changes into the ego's lane, and when its centre crosses the line the ego "
        "is the first behind it, at most 150 m. The ego keeps its lane. It begins with the "
        f"lane change; {_CHANGE_RULE}.",
        "UN R157, Annex 4, Appendix 3; de Gelder et al., IEEE ITSC 2020, doi:10.1109/"
        "ITSC45102.2020.9294222",
        (
            EGO_SPEED,
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
    event_kind(
        "cut-out",
        ("lead", "revealed"),
        "The ego's leader changes to a lane beside it, and the ego keeps its lane. Revealed is "
        "the ego's next leader when the centre of the first crosses the line. It begins with "
        "the lane change.",
        "UN R157, Annex 4, Appendix 3; de Gelder et al., IEEE ITSC 2020, doi:10.1109/"
        "ITSC45102.2020.9294222",
        (
            EGO_SPEED,
            ("lead_speed", "m/s", "speed of the leader at the beginning"),
            ("gap", "m", "from the ego to the leader at the beginning"),
            ("revealed_speed", "m/s", "speed of the revealed vehicle at the beginning"),
            ("revealed_gap", "m", "from the leader to the revealed vehicle at the beginning"),
            *_CHANGE,
            _WIDTH,
            _LEAD_TIME,
        ),
    ),
    event_kind(
        "lead-brakes",
        ("lead", "next"),
        "The ego's leader, in the same lane as the ego, slows down by 2 m/s or more, at 2 m/s² "
        "or more: a ramp of its speed that fits best. It is the leader from the beginning to "
        "the end of the ramp. Next is the leader's own leader.",
        "UN R157, Annex 4, Appendix 3 (deceleration); the thresholds are ours",
        (
            EGO_SPEED,
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
    event_kind(
        "approach",
        ("lead",),
        "The ego is faster than its leader by 2 m/s or more, and the time to collision is at "
        "most 10 s, for 0.5 s or more; the leader brakes and accelerates by at most 1 m/s² at "
        "the beginning.",
        "NHTSA, Pre-Crash Scenario Typology (DOT HS 810 767), lead vehicle stopped, lead "
        "vehicle moving at lower constant speed; the thresholds are ours",
        (
            EGO_SPEED,
            ("lead_speed", "m/s", "speed of the leader at the beginning"),
            ("relative_speed", "m/s", "ego_speed less lead_speed"),
            ("gap", "m", "at the beginning"),
            (
                "lead_offset",
                "m",
                "of the leader's centre from the middle of the lane, left positive",
            ),
            _WIDTH,
            _LEAD_TIME,
        ),
    ),
    event_kind(
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
    event_kind(
        "lane-change",
        ("lead", "new_lead", "follower"),
        "The ego changes lane. Leader is whoever was ahead in the old lane; new leader and "
        "follower are those of the new lane when the centre crosses the line. An overtaking is "
        "one with a passing_time.",
        "Toledo and Zohar, Transportation Research Record 1999 (2007) 71-78",
        (
            EGO_SPEED,
            ("lead_speed", "m/s", "speed of the leader at the beginning"),
            ("gap", "m", "to the leader at the beginning"),
            ("new_lead_speed", "m/s", "speed of the new leader at the crossing"),
            ("new_lead_gap", "m", "to the new leader at the crossing"),
            ("follower_speed", "m/s", "speed of the follower at the crossing"),
            ("follower_gap", "m", "from the follower to the ego at the crossing"),
            *_CHANGE,
            _WIDTH,
            (
                "passing_time",
                "s",
                "from the beginning until the ego is level with the leader of the old lane",
            ),
        ),
    ),
)
