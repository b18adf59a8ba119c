"""Labels of a conflict: its type, the zones that touch, the responsible party, and the rule.

Sources of the types: Najm, Smith, Yanagisawa, Pre-Crash Scenario Typology for Crash Avoidance
Research, DOT HS 810 767 (NHTSA, 2007); GIDAS, type of accident (GDV, 2016). docs/conflicts.md
shows a picture of each.
"""

from enum import IntEnum

from bridgegen.assess.conflict import _codes
from bridgegen.base.physics import CAREFUL_BRAKING_G, CAREFUL_REACTION
from bridgegen.scenario.countries import COUNTRIES, in_the_mirror


class ConflictType(IntEnum):
    """The type of conflict of two participants; the ego is the first of them."""

    NONE = _codes.NONE
    REAR_END_STRIKING = _codes.REAR_END_STRIKING
    REAR_END_STRUCK = _codes.REAR_END_STRUCK
    CROSSING = _codes.CROSSING
    TURNING = _codes.TURNING
    SIDE_SWIPE = _codes.SIDE_SWIPE
    HEAD_ON = _codes.HEAD_ON
    EGO_STANDING = _codes.EGO_STANDING
    VRU_BY_FRONT = _codes.VRU_BY_FRONT
    VRU_INTO_SIDE = _codes.VRU_INTO_SIDE
    OBJECT = _codes.OBJECT
    LANE_DEPARTURE = _codes.LANE_DEPARTURE
    ROAD_DEPARTURE = _codes.ROAD_DEPARTURE
    CLOSE_PASS = _codes.CLOSE_PASS
    UNJUSTIFIED_BRAKING = _codes.UNJUSTIFIED_BRAKING

    @property
    def label(self) -> str:
        """Its label in texts and files; empty for NONE."""
        return _TYPE_LABELS[self]

    @property
    def source(self) -> str:
        """The typology's name for it."""
        return _TYPE_SOURCES[self]


_TYPE_LABELS = {
    ConflictType.NONE: "",
    ConflictType.REAR_END_STRIKING: "front-to-rear striking",
    ConflictType.REAR_END_STRUCK: "front-to-rear struck",
    ConflictType.CROSSING: "crossing",
    ConflictType.TURNING: "turning",
    ConflictType.SIDE_SWIPE: "side-swipe",
    ConflictType.HEAD_ON: "head-on",
    ConflictType.EGO_STANDING: "ego standing",
    ConflictType.VRU_BY_FRONT: "vulnerable road user, front",
    ConflictType.VRU_INTO_SIDE: "vulnerable road user, side",
    ConflictType.OBJECT: "object",
    ConflictType.LANE_DEPARTURE: "lane departure",
    ConflictType.ROAD_DEPARTURE: "road departure",
    ConflictType.CLOSE_PASS: "close pass",
    ConflictType.UNJUSTIFIED_BRAKING: "unjustified braking",
}

_TYPE_SOURCES = {
    ConflictType.NONE: "",
    ConflictType.REAR_END_STRIKING: "NHTSA: lead vehicle stopped, decelerating, slower; GIDAS 6",
    ConflictType.REAR_END_STRUCK: "NHTSA: lead vehicle stopped, decelerating, slower; GIDAS 6",
    ConflictType.CROSSING: "NHTSA: straight crossing paths; GIDAS 3",
    ConflictType.TURNING: "NHTSA: left turn across path, turn into path; GIDAS 2, 3",
    ConflictType.SIDE_SWIPE: "NHTSA: changing lanes, drifting; GIDAS 6",
    ConflictType.HEAD_ON: "NHTSA: opposite direction; GIDAS 6",
    ConflictType.EGO_STANDING: "NHTSA: lead vehicle stopped, parked vehicle; GIDAS 5, 6",
    ConflictType.VRU_BY_FRONT: "NHTSA: pedestrian, pedalcyclist; GIDAS 4",
    ConflictType.VRU_INTO_SIDE: "NHTSA: pedestrian, pedalcyclist; GIDAS 4",
    ConflictType.OBJECT: "NHTSA: object contacted, parked vehicle; GIDAS 5, 7",
    ConflictType.LANE_DEPARTURE: "NHTSA: drifting, opposite direction; GIDAS 1, 6",
    ConflictType.ROAD_DEPARTURE: "NHTSA: road edge departure, control loss; GIDAS 1",
    ConflictType.CLOSE_PASS: "NHTSA: pedalcyclist, pedestrian; GIDAS 6",
    ConflictType.UNJUSTIFIED_BRAKING: "NHTSA: lead vehicle decelerating; GIDAS 6",
}


class Zone(IntEnum):
    """The edge or corner of a body in a contact."""

    NONE = _codes.NO_ZONE
    FRONT = _codes.FRONT
    FRONT_LEFT = _codes.FRONT_LEFT
    LEFT = _codes.LEFT
    REAR_LEFT = _codes.REAR_LEFT
    REAR = _codes.REAR
    REAR_RIGHT = _codes.REAR_RIGHT
    RIGHT = _codes.RIGHT
    FRONT_RIGHT = _codes.FRONT_RIGHT

    @property
    def label(self) -> str:
        """In words: ``front left corner``, ``right side``; empty for NONE."""
        words = self.name.lower().replace("_", " ") if self else ""
        if self in (Zone.LEFT, Zone.RIGHT):
            return f"{words} side"
        return f"{words} corner" if " " in words else words

    @property
    def other_side(self) -> "Zone":
        """The same edge or corner in the mirror."""
        return Zone[in_the_mirror(self.name.replace("_", " ")).upper().replace(" ", "_")]


class Responsible(IntEnum):
    """The party responsible for a conflict."""

    NONE = _codes.NEITHER
    EGO = _codes.EGO
    OTHER = _codes.OTHER
    SHARED = _codes.SHARED

    @property
    def label(self) -> str:
        """Its label in texts and files."""
        return self.name.lower()


class Rule(IntEnum):
    """The rule that decides on responsibility; ``RULES`` has descriptions and sources."""

    NONE = _codes.NO_RULE
    STRUCK_STANDING = _codes.STRUCK_STANDING
    RED_LIGHT = _codes.RED_LIGHT
    REAR_DISTANCE = _codes.REAR_DISTANCE
    BRAKED_WITHOUT_REASON = _codes.BRAKED_WITHOUT_REASON
    CUT_IN = _codes.CUT_IN
    CUT_IN_PREVENTABLE = _codes.CUT_IN_PREVENTABLE
    REVEALED_LATE = _codes.REVEALED_LATE
    MAP_PRIORITY = _codes.MAP_PRIORITY
    SIGNS = _codes.SIGNS
    RIGHT_BEFORE_LEFT = _codes.RIGHT_BEFORE_LEFT
    ONCOMING_FIRST = _codes.ONCOMING_FIRST
    TURNING_GIVES_WAY = _codes.TURNING_GIVES_WAY
    JUNCTION_OCCUPIED = _codes.JUNCTION_OCCUPIED
    LEFT_ITS_LANE = _codes.LEFT_ITS_LANE
    CROSSWALK = _codes.CROSSWALK
    STEPPED_OUT = _codes.STEPPED_OUT
    COULD_HAVE_STOPPED = _codes.COULD_HAVE_STOPPED
    INTO_THE_SIDE = _codes.INTO_THE_SIDE
    STANDING_AHEAD = _codes.STANDING_AHEAD
    ASSUMED_RIGHT_BEFORE_LEFT = _codes.ASSUMED_RIGHT_BEFORE_LEFT
    UNSAFE_START = _codes.UNSAFE_START
    BRAKED_HARD_AHEAD = _codes.BRAKED_HARD_AHEAD
    EMERGENCY_VEHICLE = _codes.EMERGENCY_VEHICLE
    FROM_OFF_ROAD = _codes.FROM_OFF_ROAD
    WRONG_SIDE = _codes.WRONG_SIDE
    PASSED_TOO_CLOSE = _codes.PASSED_TOO_CLOSE
    DID_NOT_KEEP_LANE = _codes.DID_NOT_KEEP_LANE
    LEFT_THE_ROAD = _codes.LEFT_THE_ROAD
    CUT_IN_REQUIRED = _codes.CUT_IN_REQUIRED
    REVERSED = _codes.REVERSED
    NO_PRIORITY = _codes.NO_PRIORITY
    OPENED = _codes.OPENED
    MISLED = _codes.MISLED
    OBSTRUCTION_WAITS = _codes.OBSTRUCTION_WAITS

    @property
    def label(self) -> str:
        """Its label in texts and files; empty for NONE."""
        return self.name.lower().replace("_", " ") if self else ""


RULES = {
    Rule.NONE: ("", ""),
    Rule.STRUCK_STANDING: (
        "drove into a standing vehicle",
        "StVO § 1 (2), § 4 (1); UN R157, 5.1.1: a vehicle that stands cannot avoid the collision",
    ),
    Rule.RED_LIGHT: ("crossed the stop line at red", "Vienna Convention, Art. 23; StVO § 37 (2)"),
    Rule.REAR_DISTANCE: (
        "did not keep a safe distance to the vehicle ahead",
        "RSS (Shalev-Shwartz et al., 2017), definition 1; StVO § 4 (1)",
    ),
    Rule.BRAKED_WITHOUT_REASON: (
        "braked hard although nothing in or entering its way asked for it",
        "StVO § 4 (1), sentence 2; Vienna Convention, Art. 17 (1)",
    ),
    Rule.CUT_IN: (
        "cut in so closely that braking from then on could not have avoided it",
        "UN R157, 5.2.5.2 and Annex 3; StVO § 7 (5)",
    ),
    Rule.CUT_IN_PREVENTABLE: (
        "did not avoid a cut-in that left enough time to brake",
        "UN R157, 5.2.5.2 and Annex 3",
    ),
    Rule.REVEALED_LATE: (
        "the obstacle was revealed later than it takes to stop",
        "UN R157, Annex 3, cut-out",
    ),
    Rule.MAP_PRIORITY: (
        "disregarded the priority that the map states",
        "OpenDRIVE, junction priority",
    ),
    Rule.SIGNS: ("disregarded signs of priority", "Vienna Convention, Art. 18; StVO § 8 (1)"),
    Rule.RIGHT_BEFORE_LEFT: (
        "did not give way to traffic from the right",
        "Vienna Convention, Art. 18 (4); StVO § 8 (1)",
    ),
    Rule.ONCOMING_FIRST: (
        "turned left across oncoming traffic",
        "Vienna Convention, Art. 16 (2); StVO § 9 (3)",
    ),
    Rule.TURNING_GIVES_WAY: (
        "turned across the path of a participant who went straight on",
        "Vienna Convention, Art. 16 (2); StVO § 9 (3)",
    ),
    Rule.JUNCTION_OCCUPIED: (
        "drove on although the way was occupied early enough to brake comfortably",
        "RSS (Shalev-Shwartz et al., 2017), principle 3; StVO § 11 (3)",
    ),
    Rule.LEFT_ITS_LANE: (
        "moved sideways into the way of the other",
        "RSS (Shalev-Shwartz et al., 2017), definition 6; StVO § 7 (5), § 2 (2)",
    ),
    Rule.CROSSWALK: (
        "did not stop for a pedestrian on a crosswalk",
        "Vienna Convention, Art. 21 (2); StVO § 26 (1)",
    ),
    Rule.STEPPED_OUT: (
        "came into the path when stopping was no longer possible",
        "StVO § 25 (3); UN R157, 5.2.5.3 and Annex 3",
    ),
    Rule.COULD_HAVE_STOPPED: (
        "did not stop for a vulnerable road user who was in the path for long enough",
        "StVO § 1 (2), § 3 (2a); UN R157, 5.2.5.3 and Annex 3",
    ),
    Rule.INTO_THE_SIDE: ("moved into the side of the other", "StVO § 1 (2), § 25 (3)"),
    Rule.STANDING_AHEAD: (
        "did not stop for what stood in the path for long enough",
        "StVO § 3 (1): stop within the distance seen",
    ),
    Rule.ASSUMED_RIGHT_BEFORE_LEFT: (
        "did not give way to traffic from the right; no priority is known, so this is assumed",
        "StVO § 8 (1)",
    ),
    Rule.UNSAFE_START: (
        "from the start on, or from where a body appears, there was less time than it takes",
        f"UN R157, Annex 3: reaction {CAREFUL_REACTION:g} s, {CAREFUL_BRAKING_G:g} g",
    ),
    Rule.EMERGENCY_VEHICLE: (
        "did not give way to an emergency vehicle with blue light and siren",
        "Vienna Convention, Art. 34 (1); StVO § 38 (1)",
    ),
    Rule.FROM_OFF_ROAD: (
        "came onto the road from beside it and did not give way to traffic on it",
        "Vienna Convention, Art. 18 (3); StVO § 10",
    ),
    Rule.WRONG_SIDE: (
        "drove on the wrong side of the road, towards the other",
        "Vienna Convention, Art. 10; StVO § 2 (1), (2)",
    ),
    Rule.DID_NOT_KEEP_LANE: (
        "did not keep to its lane",
        "StVO § 2 (2), § 7; UN R79 and UN R130, departure from the lane",
    ),
    Rule.LEFT_THE_ROAD: ("left the road", "StVO § 2 (1), § 3 (1); UN R79, departure from the lane"),
    Rule.PASSED_TOO_CLOSE: (
        "overtook a cyclist without enough room to the side",
        "StVO § 5 (4): 1.5 m at least in towns, 2 m outside them",
    ),
    Rule.CUT_IN_REQUIRED: (
        "did not avoid a cut-in that a system must avoid: it came over the marking at more than "
        "v / 12 m/s² + 0.35 s to collision, v being the closing speed",
        "UN R157, 5.2.5.2",
    ),
    Rule.REVERSED: (
        "reversed towards the other, or across its way",
        "Vienna Convention, Art. 14 (2); StVO § 9 (5)",
    ),
    Rule.OBSTRUCTION_WAITS: (
        "passed an obstruction on the lane of oncoming traffic, and did not let the other go first",
        "Vienna Convention, Art. 12 (1); StVO § 6",
    ),
    Rule.NO_PRIORITY: (
        "drove on where nobody has priority by law",
        COUNTRIES["UK"].source,
    ),
    Rule.MISLED: (
        "did not give way to one that indicated a turn, slowed down and went straight on",
        "StVO § 1 (2), § 8 (2); Oberlandesgericht Dresden, 24 April 2014, 7 U 1501/13",
    ),
    Rule.OPENED: (
        "opened into the path when stopping was no longer possible",
        "StVO § 14 (1); Vienna Convention, Art. 24",
    ),
    Rule.BRAKED_HARD_AHEAD: (
        "the vehicle ahead braked so hard that a careful driver would have come as near",
        "UN R157, Annex 3, deceleration; RSS (2017), definition 1",
    ),
}
"""Each rule's statement on the responsible party, or on the event if there is none; its source."""
