"""The numbers that the compiler writes into a program's tables and the kernels read there.

Without numba, so that compiling a storyboard does not wait for it; private like the kernels, so
that the cache of compiled code knows when one of them changes.
"""

# Program.elements: one row per element of the storyboard, each before its children.
KIND, PARENT, END, START, STOP, PRIORITY, COUNT, FIRST, LAST, EVENT_NUMBER = range(10)
STORY, ACT, GROUP, MANEUVER, EVENT, ACTION = range(6)
OVERRIDE, SKIP, PARALLEL = range(3)

# State.phase: OFF until the element's parent runs, then the standard's three states.
OFF, STANDBY, RUNNING, COMPLETE = range(4)
# State.stamps: the columns.
STARTED, ENDED, STOPPED, SKIPPED = range(4)

# Program.actions: the entity that it is about; what it does; shape and dimension of its course;
# slots of its target and of what it lasts; a row of ``laterals``, ``weathers``, ``courses``,
# places, routes or trajectories; whether the trigger selects the entity.
WHOM, DOES, SHAPE, DIMENSION, TARGET, LASTS, ROW, SELECTS = range(8)
STEERS, SETS_SPEED = 2, 3  # of a control: whether the driver does, -1 as before
TOWED = 3  # of a connection: the trailer
TO_SENSORS, TO_TRAFFIC = 3, 6  # of showing: whether these see it
IS_HELD, COLUMN = 2, 3  # of pressing: whether it is held, not let go of; which of the pedals
THROTTLE, BRAKE, PARKING_BRAKE, STEERING, IDLE = range(5)
PEDALS = 5
LAMP, IS_LIT = 3, 6  # of switching: what, as bits of `bridgegen.drivers.kinds`; whether it is on
DETAIL = 3  # of a route, its position; of a trajectory, whether its times are relative
PASSES = 2  # of a date: whether time passes
# What they do, by groups: of one entity from FIRST_MOTION on, of these along its path by
# Program.courses after SPEED_CHANGE, and across it; of all, whose first column is a light, a
# controller, a value.
FIRST_MOTION, FIRST_ALONG, FIRST_ACROSS, FIRST_GLOBAL = 20, 40, 50, 100
ADD_ENTITY, DELETE_ENTITY, CONTROL = 20, 21, 22
CONNECT_TRAILER, DISCONNECT_TRAILER, SHOW, SWITCH, PRESS = 23, 24, 25, 26, 27
TELEPORT, ASSIGN_ROUTE, FOLLOW, ACQUIRE, FOLLOW_LAID = range(30, 35)
SPEED_CHANGE, RELATIVE_SPEED, SPEED_PROFILE, KEEP_DISTANCE, SYNCHRONIZE = range(40, 45)
LANE_CHANGE, LANE_OFFSET, KEEP_ASIDE = range(50, 53)
TIME_CHANGE, PHASE_CHANGE, VALUE_SET, VALUE_ADD, VALUE_MULTIPLY = range(100, 105)
WEATHER_CHANGE, LIGHT = 105, 106

# State.hidden: from whom an entity is hidden.
FROM_SENSORS, FROM_TRAFFIC = 0, 1

# State.drives: what of the ego its driver does.
LATERALLY, LONGITUDINALLY = 0, 1

# Program.conditions: first and past-the-last probe, how they count, edge, delay in steps.
PROBES, PROBES_END, QUANTITY, EDGE, DELAY = range(5)
ANY, ALL, NOBODY = range(3)
NO_EDGE, RISING, FALLING, EITHER = range(4)

# Program.probes: what is looked at, by whom and at whom (-1: at a place), the rule and the slot of
# what it is compared with; how a distance is measured; a second slot; whether seldom asked for.
# A place is one of the points that do not move, or, AT_MARK, one of ``State.marks``.
PROBE, WHO, OTHER, RULE, LIMIT, PLACE, MEASURE, SYSTEM, BOXES, WITHIN, CLOSELY = range(11)
NEVER_TRUE, SIMULATION_TIME, ELEMENT_STATE, VALUE, TIME_OF_DAY, LIGHT_STATE, LIGHT_PHASE = range(7)
FIRST_BY_ENTITY = 10
SPEED, SPEED_DIFFERENCE, ACCELERATING, TRAVELED_DISTANCE, STAND_STILL = range(10, 15)
ANGLE, RELATIVE_ANGLE, COLLISION, COLLISION_WITH_TYPE, END_OF_ROAD = range(15, 20)
OFFROAD, CLEARANCE = 20, 21
DISTANCE, TIME_TO_COLLISION, TIME_HEADWAY = range(30, 33)
AT_POINT, AT_MARK = -1, -2
GREATER, LESS, EQUAL, GREATER_EQUAL, LESS_EQUAL, NOT_EQUAL = range(6)
EUCLIDIAN, LONGITUDINAL, LATERAL = range(3)
TOTAL, VERTICAL = 0, 3  # with LONGITUDINAL and LATERAL, the directions of a speed
ENTITY_SYSTEM, PATH_SYSTEM, WORLD_SYSTEM, ROAD_SYSTEM = range(4)

# Program.clearances: which of ``ranges``, whether lanes of the other direction count; then by
# entity whether it counts.
RANGES, RANGES_END, OPPOSITE, COUNTS = range(4)

# Program.courses: the entity that it goes by, -1 if none; then by kind, slots where not said else.
REF = 0
IS_FACTOR, CONTINUOUS = 1, 2  # of a relative speed; also of a distance, CONTINUOUS
FOLLOWS, FIRST_ENTRY, PAST_ENTRY = 1, 2, 3  # of a profile
IS_TIME_GAP, FREESPACE, SIDE, BY_BODY, UNLIMITED = 1, 3, 4, 10, 11  # of a distance
MOST = 5  # of both: 5 to 9, the most acceleration, deceleration, speed, rates of both; -1: not said
OWN_PLACE, MASTER_PLACE, TOLERANCE, MASTER_TOLERANCE = 1, 2, 3, 4  # of a synchronisation
FINAL, FINAL_VALUE, STEADY, STEADY_VALUE = 5, 6, 7, 8
NO_FINAL, FINAL_SPEED, FINAL_DELTA, FINAL_FACTOR = range(4)
NOT_STEADY, STEADY_DISTANCE, STEADY_TIME = range(3)
COURSE_WIDTH = 12
IS_PRESENT = 1  # of a lateral distance: the one there is; also 2 to 4 and 10, 11 as of a distance
EITHER_SIDE, BEHIND, AHEAD = 0, 1, -1
LEFT_SIDE, RIGHT_SIDE = 1, -1

# State.course: what a course keeps.
SIDE_TAKEN, ACCELERATION, FOOT, FOOT_PATH = range(4)  # of a distance
OWN_X, OWN_Y, MASTER_X, MASTER_Y, LEFT, MASTER_LEFT = range(6)  # of a synchronisation
COURSE_MEMORY = 6

# Program.places: kind, entity, lanes to the left, slots of the two numbers, whether the heading is
# absolute, its slot, whether ahead and left are those of the lane's traffic, not of the road.
PLACE_KIND, WHOSE, LANES_LEFT, ALONG, ACROSS, ABSOLUTE, HEADING, BY_LANE = range(8)
ON_LANE, ON_ROAD, IN_WORLD, BY_LANES, BY_ROAD, BY_OBJECT, BY_WORLD, BY_TRAJECTORY = range(8)
LAYOUT = 2  # of a place along a trajectory, in the place of the lanes to the left

# Program.layouts: first and past-the-last anchor and row of shapes, how the vertices follow from
# them, whether they have times, slots of what these are multiplied by and then moved by [s].
FIRST_ANCHOR, PAST_ANCHOR, FIRST_SAMPLE, PAST_SAMPLE, LAYOUT_SHAPE, IS_TIMED = range(6)
LAYOUT_SCALE, LAYOUT_OFFSET = 6, 7
LAYOUT_WIDTH = 8
THROUGH, RIGID, WEIGHTED = range(3)  # the anchors; a line from the one anchor; their means
