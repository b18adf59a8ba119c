"""All codes of the conflict analysis.

``types`` gives them names and labels, ``analysis`` and the kernels use them. Stores record them:
append, never renumber. The module is private because compiled code is rebuilt when a private module
changes (``bridgegen.base.compiled``).
"""

NO_CONFLICT, COURSE, NEAR_MISS, CONTACT, VIOLATION = range(5)
"""Kinds of conflicts; a violation needs no one near, see ``violations``."""

(
    NONE, REAR_END_STRIKING, REAR_END_STRUCK, CROSSING, TURNING, SIDE_SWIPE, HEAD_ON, EGO_STANDING,
    VRU_BY_FRONT, VRU_INTO_SIDE, OBJECT, LANE_DEPARTURE, ROAD_DEPARTURE, CLOSE_PASS,
    UNJUSTIFIED_BRAKING,
) = range(15)  # fmt: skip
"""Codes of the types of conflicts."""

(
    NO_ZONE,
    FRONT,
    FRONT_LEFT,
    LEFT,
    REAR_LEFT,
    REAR,
    REAR_RIGHT,
    RIGHT,
    FRONT_RIGHT,
) = range(9)
"""Edges and corners of a body, counter-clockwise from its front."""

NEITHER, EGO, OTHER, SHARED = range(4)
"""Codes of the responsible parties."""

(
    NO_RULE, STRUCK_STANDING, RED_LIGHT, REAR_DISTANCE, BRAKED_WITHOUT_REASON, CUT_IN,
    CUT_IN_PREVENTABLE, REVEALED_LATE, MAP_PRIORITY, SIGNS, RIGHT_BEFORE_LEFT, ONCOMING_FIRST,
    TURNING_GIVES_WAY, JUNCTION_OCCUPIED, LEFT_ITS_LANE, CROSSWALK, STEPPED_OUT,
    COULD_HAVE_STOPPED, INTO_THE_SIDE, STANDING_AHEAD, ASSUMED_RIGHT_BEFORE_LEFT, UNSAFE_START,
    BRAKED_HARD_AHEAD, EMERGENCY_VEHICLE, FROM_OFF_ROAD, WRONG_SIDE,
    PASSED_TOO_CLOSE, DID_NOT_KEEP_LANE, LEFT_THE_ROAD, CUT_IN_REQUIRED, REVERSED, NO_PRIORITY,
    OPENED, MISLED, OBSTRUCTION_WAITS,
) = range(35)  # fmt: skip
"""Rules of responsibility. The four from MAP_PRIORITY on are in the order of the claims of
`bridgegen.drivers.right_of_way`; EMERGENCY_VEHICLE and FROM_OFF_ROAD are those of a siren and of
who comes from off the road."""

(
    KIND,
    TYPE,
    RESPONSIBLE,
    RULE,
    INSTANT,
    DECIDED,
    ZONE_EGO,
    ZONE_OTHER,
    PREVENTABLE,
    LEADS_EGO,
) = range(10)
INTEGERS = 10
"""Number of columns of a pair's row of whole numbers, after the columns themselves."""

(
    TTC,
    NEEDED,
    ACROSS,
    ALONG,
    V_EGO,
    V_OTHER,
    STOOD_EGO,
    STOOD_OTHER,
    OVERLAP,
    NEARNESS,
    LEFT_TO_ACT,
) = range(11)
FLOATS = 11
"""Number of columns of a pair's row of floats, after the columns themselves."""
