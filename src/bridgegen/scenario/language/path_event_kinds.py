"""The kinds of events of paths that cross or join, with lanes or without.

Distances are along the paths, between the centres of the bodies and the point at which the paths
cross or join.
"""

from bridgegen.scenario.language.event_kind import EGO_SPEED, event_kind

_MEETING = (
    EGO_SPEED,
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
_PACE = (
    ("pace_before", "m/s", "speed of the other before the greatest change of its pace"),
    ("pace_after", "m/s", "its speed after that"),
    ("pace_distance", "m", "from the other to the crossing point when that begins"),
    ("pace_ego_distance", "m", "from the ego to the crossing point then, negative beyond it"),
    ("pace_apart", "m", "between the reference points of both then"),
)
_MEETING_RULE = (
    "The centres of both pass the point at which their paths cross within 6 s. It begins 6 s "
    "before the first of both passes, or when both are recorded, if that is later; it ends when "
    "the second passes."
)
_MEETING_SOURCE = (
    "NHTSA, Pre-Crash Scenario Typology (DOT HS 810 767), {}; Allen, Shin, Cooper, Transportation "
    "Research Record 667 (1978) 67-74 (post-encroachment time); the thresholds are ours"
)

_MERGING = (
    EGO_SPEED,
    ("other_speed", "m/s", "speed of the other at the beginning"),
    ("ego_distance", "m", "from the ego to the joining point at the beginning"),
    ("other_distance", "m", "from the other to the joining point at the beginning"),
    ("ego_joining_speed", "m/s", "speed of the ego at the joining point"),
    ("other_joining_speed", "m/s", "speed of the other at the joining point"),
    ("ego_merges", "1", "1 if the ego comes into the other's lane, 0 if the other into the ego's"),
    ("ego_first", "1", "1 if the ego passes the joining point first, else 0"),
    ("time_gap", "s", "between the instants at which their centres pass the joining point"),
    (
        "pet",
        "s",
        "post-encroachment time, until 1 s after the second has passed the joining point",
    ),
    ("gap", "m", "between both when the one that merges passes the joining point"),
    ("lead_gap", "m", "from the one that merges to whoever is ahead of it in the lane then"),
    ("follower_gap", "m", "from whoever is behind it then to the one that merges"),
    ("angle", "deg", "between their courses 5 m of path before, or of their lanes, 0 to 180"),
    ("side", "1", "1 if the other comes from the right, -1 from the left"),
    ("seen_time", "s", "from the beginning until the first of both passes the joining point"),
    ("set_off_distance", "m", "from the other to the joining point when it sets off last"),
    ("set_off_ego_distance", "m", "from the ego to the joining point then, negative beyond it"),
    ("set_off_apart", "m", "between the reference points of both then"),
    ("lane_left", "m", "from the joining point to the end of the lane that ends"),
    ("change_time", "s", "duration of the sinusoidal lane change that fits best"),
    ("change_distance", "m", "from where that begins to the joining point"),
    ("slow_speed", "m/s", "of the one that merges, before it speeds up"),
    ("fast_speed", "m/s", "of it, once it has"),
    ("speeding_rate", "m/s²", "slope of the ramp of its speed that fits best"),
    ("speeding_distance", "m", "from it to the joining point when it begins to speed up"),
    ("speeding_main_distance", "m", "from the other to the joining point then"),
)

PATH_KINDS = (
    event_kind(
        "crossing",
        ("other",),
        "The path of another motor vehicle crosses the ego's at 30° to 150°. The ego goes "
        "straight on: it turns by 30° at most from 30 m before to 15 m after. They do not come "
        f"from opposite directions. {_MEETING_RULE}",
        _MEETING_SOURCE.format("straight crossing paths, left turn across path from a side"),
        (
            *_MEETING,
            _EGO_FIRST,
            ("other_turn", "deg", "by how much the other turns, to the left positive"),
            ("ego_ran_red", "1", "1 if the ego ran a red light before, else 0"),
            ("other_ran_red", "1", "1 if the other ran one, else 0"),
            *_PACE,
        ),
        needs_lanes=False,
        of_lights=("ego_ran_red", "other_ran_red"),
    ),
    event_kind(
        "oncoming-left-turn",
        ("other",),
        "The ego and another motor vehicle come from opposite directions: their courses 30 m "
        "before are 145° apart or more. One of them turns by more than 20° across the path of "
        "the other, which goes straight on. Where traffic drives on the left that is a right "
        f"turn. {_MEETING_RULE}",
        _MEETING_SOURCE.format("left turn across path from opposite directions"),
        (
            *_MEETING,
            _EGO_FIRST,
            ("ego_turns", "1", "1 if the ego turns, 0 if the other does"),
            ("turn", "deg", "by how much the one turns that does"),
        ),
        needs_lanes=False,
    ),
    event_kind(
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
            (
                "occluder_gap",
                "m",
                "along the ego's course, from the crossing point to the "
                "nearest end of what hides it",
            ),
        ),
        needs_lanes=False,
    ),
    event_kind(
        "merging",
        ("other",),
        "The ego and another motor vehicle come to one lane, and the centres of both pass the "
        "joining point within 6 s, and nobody else between them. Either their paths join: they "
        "are 20° to 150° apart 5 m before the joining point, do not cross, and lead the same way "
        "from there for 10 m or more, less than 2 m apart; who merges is the one that has not "
        "come along the bend of the shared part, continued backwards. Or one leaves a lane that "
        "ends within 400 m, at the line that it crosses; or two lanes lead into one. It begins 6 "
        "s before the first of both passes, or when both are recorded, if that is later; it ends "
        "when the second passes.",
        "NHTSA, Pre-Crash Scenario Typology (DOT HS 810 767), vehicles changing lanes, turning at "
        "junctions; FHWA, NCHRP Report 672 (2010), entering and circulating vehicles; the "
        "thresholds are ours",
        _MERGING,
        needs_lanes=False,
    ),
    event_kind(
        "red-light-violation",
        (),
        "The front of the ego passes the stop line of a lane whose light has been red for more "
        "than 0.3 s: at most 1.75 m beside the lane's middle, within 45° of its direction; beyond "
        "the line it follows that lane within 2 m. Of several lights at a line, that of the lane "
        "counts which it follows best. It begins 6 s before, or when it is recorded, if that is "
        "later.",
        "NHTSA, Pre-Crash Scenario Typology (DOT HS 810 767), running red light; the thresholds "
        "are ours",
        (
            EGO_SPEED,
            ("ego_distance", "m", "driven until its front is over the stop line"),
            ("line_speed", "m/s", "speed at the stop line"),
            ("least_speed", "m/s", "its lowest speed before"),
            ("red_time", "s", "how long the light has been red, or has been recorded as red"),
            ("red_seen", "1", "1 if it is recorded to turn red, 0 if it is red from the beginning"),
            ("red_speed", "m/s", "speed of the ego when the light turns red"),
            ("red_distance", "m", "from its front to the stop line then"),
            ("turn", "deg", "by how much it turns from 5 m before to 25 m after, left positive"),
        ),
        needs_lanes=False,
        needs_lights=True,
    ),
    event_kind(
        "right-turn-with-bicycle",
        ("other",),
        "The ego turns right by more than 45°, and crosses at 15° to 160° the path of a bicycle on "
        "its right that goes straight on. Their courses 30 m before are at most 45° apart. "
        f"{_MEETING_RULE}",
        "Euro NCAP, AEB/LSS VRU, CBTA; UN Regulation No. 151; the thresholds are ours",
        (
            *_MEETING,
            _EGO_FIRST,
            ("ego_turn", "deg", "by how much the ego turns, to the left positive"),
            (
                "ahead",
                "m",
                "from the ego's centre to that of the bicycle along the ego's course "
                "at the beginning, negative behind it",
            ),
            ("aside", "m", "likewise across it, to the right positive"),
            *_PACE,
        ),
        needs_lanes=False,
    ),
    event_kind(
        "bicycle-swings-out",
        ("other", "obstacle"),
        "A bicycle ahead of the ego, in its direction within 30°, moves sideways by 0.5 m or more: "
        "before, its body is clear of the ego's path, after that it is in it. The move is the half "
        "wave of a cosine that fits best. The ego would be there within 6 s, and its path bends "
        "by 30° at most until then. The path is smoothed over 40 m before and after, so that its "
        "own evasion counts little. An obstacle is the nearest vehicle that stands ahead of the "
        "bicycle, at most 50 m, where it would have passed within 0.5 m.",
        "Euro NCAP, AEB/LSS VRU, CBLA; the thresholds are ours",
        (
            EGO_SPEED,
            ("other_speed", "m/s", "speed of the bicycle at the beginning"),
            ("relative_speed", "m/s", "ego_speed less other_speed"),
            ("gap", "m", "from the ego to the bicycle at the beginning"),
            ("offset_before", "m", "of the bicycle from the ego's path, left positive"),
            ("offset_after", "m", "likewise after the move"),
            ("change_time", "s", "how long the move takes"),
            ("lateral_speed", "m/s", "width of the move by its duration"),
            ("side", "1", "1 if the bicycle comes from the right, -1 from the left"),
            ("obstacle_gap", "m", "from the bicycle to the obstacle at the beginning"),
            ("obstacle_apart", "m", "between the reference points of both then"),
        ),
        needs_lanes=False,
    ),
)
