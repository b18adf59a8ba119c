"""The standard's enumerations, values verbatim, the union of versions 1.0 to 1.3."""

from enum import StrEnum


class ParameterType(StrEnum):
    """The type of a parameter; ``integer`` is the old name of ``int``."""

    BOOLEAN = "boolean"
    DATE_TIME = "dateTime"
    DOUBLE = "double"
    INTEGER = "integer"
    INT = "int"
    STRING = "string"
    UNSIGNED_INT = "unsignedInt"
    UNSIGNED_SHORT = "unsignedShort"


class Rule(StrEnum):
    """How a condition compares."""

    EQUAL_TO = "equalTo"
    GREATER_THAN = "greaterThan"
    LESS_THAN = "lessThan"
    GREATER_OR_EQUAL = "greaterOrEqual"
    LESS_OR_EQUAL = "lessOrEqual"
    NOT_EQUAL_TO = "notEqualTo"


class ConditionEdge(StrEnum):
    """The change of a condition's truth that counts; ``none`` is being true."""

    NONE = "none"
    RISING = "rising"
    FALLING = "falling"
    RISING_OR_FALLING = "risingOrFalling"


class CoordinateSystem(StrEnum):
    """In which a distance is measured."""

    ENTITY = "entity"
    LANE = "lane"
    ROAD = "road"
    TRAJECTORY = "trajectory"
    WORLD = "world"


class RelativeDistanceType(StrEnum):
    """Which distance; ``cartesianDistance`` is 1.0's name of ``euclidianDistance``."""

    LATERAL = "lateral"
    LONGITUDINAL = "longitudinal"
    CARTESIAN_DISTANCE = "cartesianDistance"
    EUCLIDIAN_DISTANCE = "euclidianDistance"


class RoutingAlgorithm(StrEnum):
    """Which way a distance along roads takes."""

    ASSIGNED_ROUTE = "assignedRoute"
    FASTEST = "fastest"
    LEAST_INTERSECTIONS = "leastIntersections"
    SHORTEST = "shortest"
    UNDEFINED = "undefined"


class TriggeringEntitiesRule(StrEnum):
    """Whether one of the triggering entities suffices."""

    ALL = "all"
    ANY = "any"


class Priority(StrEnum):
    """What an event does to the others of its maneuver; ``overwrite`` is ``override`` up to 1.1."""

    OVERWRITE = "overwrite"
    OVERRIDE = "override"
    PARALLEL = "parallel"
    SKIP = "skip"


class DynamicsShape(StrEnum):
    """The course of a transition."""

    CUBIC = "cubic"
    LINEAR = "linear"
    SINUSOIDAL = "sinusoidal"
    STEP = "step"


class DynamicsDimension(StrEnum):
    """What limits a transition."""

    DISTANCE = "distance"
    RATE = "rate"
    TIME = "time"


class FollowingMode(StrEnum):
    """Whether the dynamics or the position of a transition is kept."""

    FOLLOW = "follow"
    POSITION = "position"


class RouteStrategy(StrEnum):
    """How a route reaches its next waypoint."""

    FASTEST = "fastest"
    LEAST_INTERSECTIONS = "leastIntersections"
    RANDOM = "random"
    SHORTEST = "shortest"


class ReferenceContext(StrEnum):
    """Whether an orientation is the world's or the lane's."""

    ABSOLUTE = "absolute"
    RELATIVE = "relative"


class VehicleCategory(StrEnum):
    """The kind of a vehicle."""

    BICYCLE = "bicycle"
    BUS = "bus"
    CAR = "car"
    MOTORBIKE = "motorbike"
    SEMITRAILER = "semitrailer"
    TRAILER = "trailer"
    TRAIN = "train"
    TRAM = "tram"
    TRUCK = "truck"
    VAN = "van"


class Role(StrEnum):
    """What a vehicle serves for."""

    NONE = "none"
    AMBULANCE = "ambulance"
    CIVIL = "civil"
    FIRE = "fire"
    MILITARY = "military"
    POLICE = "police"
    PUBLIC_TRANSPORT = "publicTransport"
    ROAD_ASSISTANCE = "roadAssistance"


class ControllerType(StrEnum):
    """What a controller commands."""

    LATERAL = "lateral"
    LONGITUDINAL = "longitudinal"
    LIGHTING = "lighting"
    ANIMATION = "animation"
    MOVEMENT = "movement"
    APPEARANCE = "appearance"
    ALL = "all"


class FractionalCloudCover(StrEnum):
    """The eighths of the sky that clouds cover; ``nineOktas``: the sky cannot be seen."""

    ZERO = "zeroOktas"
    ONE = "oneOktas"
    TWO = "twoOktas"
    THREE = "threeOktas"
    FOUR = "fourOktas"
    FIVE = "fiveOktas"
    SIX = "sixOktas"
    SEVEN = "sevenOktas"
    EIGHT = "eightOktas"
    NINE = "nineOktas"


class CloudState(StrEnum):
    """The sky up to 1.1."""

    CLOUDY = "cloudy"
    FREE = "free"
    OVERCAST = "overcast"
    RAINY = "rainy"
    SKY_OFF = "skyOff"


class PrecipitationType(StrEnum):
    """What falls."""

    DRY = "dry"
    RAIN = "rain"
    SNOW = "snow"


class Wetness(StrEnum):
    """The water on the road."""

    DRY = "dry"
    MOIST = "moist"
    WET_WITH_PUDDLES = "wetWithPuddles"
    LOW_FLOODED = "lowFlooded"
    HIGH_FLOODED = "highFlooded"


class PedestrianCategory(StrEnum):
    """What kind of pedestrian it is."""

    ANIMAL = "animal"
    PEDESTRIAN = "pedestrian"
    WHEELCHAIR = "wheelchair"


class MiscObjectCategory(StrEnum):
    """What kind of object it is."""

    BARRIER = "barrier"
    BUILDING = "building"
    CROSSWALK = "crosswalk"
    GANTRY = "gantry"
    NONE = "none"
    OBSTACLE = "obstacle"
    PARKING_SPACE = "parkingSpace"
    PATCH = "patch"
    POLE = "pole"
    RAILING = "railing"
    ROAD_MARK = "roadMark"
    SOUND_BARRIER = "soundBarrier"
    STREET_LAMP = "streetLamp"
    TRAFFIC_ISLAND = "trafficIsland"
    TREE = "tree"
    VEGETATION = "vegetation"
    WIND = "wind"


class SpeedTargetValueType(StrEnum):
    """What a relative speed is to the other's: a difference or a factor."""

    DELTA = "delta"
    FACTOR = "factor"


class StoryboardElementState(StrEnum):
    """States and transitions of a part of the storyboard."""

    COMPLETE_STATE = "completeState"
    END_TRANSITION = "endTransition"
    RUNNING_STATE = "runningState"
    SKIP_TRANSITION = "skipTransition"
    STANDBY_STATE = "standbyState"
    START_TRANSITION = "startTransition"
    STOP_TRANSITION = "stopTransition"


class StoryboardElementType(StrEnum):
    """Kinds of parts of the storyboard."""

    ACT = "act"
    ACTION = "action"
    EVENT = "event"
    MANEUVER = "maneuver"
    MANEUVER_GROUP = "maneuverGroup"
    STORY = "story"


class ObjectType(StrEnum):
    """Kinds of participants."""

    MISCELLANEOUS = "miscellaneous"
    PEDESTRIAN = "pedestrian"
    VEHICLE = "vehicle"
    EXTERNAL = "external"


class LongitudinalDisplacement(StrEnum):
    """Before or behind the other one."""

    ANY = "any"
    TRAILING_REFERENCED_ENTITY = "trailingReferencedEntity"
    LEADING_REFERENCED_ENTITY = "leadingReferencedEntity"


class LateralDisplacement(StrEnum):
    """To the left or right of the other one."""

    ANY = "any"
    LEFT_TO_REFERENCED_ENTITY = "leftToReferencedEntity"
    RIGHT_TO_REFERENCED_ENTITY = "rightToReferencedEntity"


class DirectionalDimension(StrEnum):
    """Along which of an entity's axes."""

    LONGITUDINAL = "longitudinal"
    LATERAL = "lateral"
    VERTICAL = "vertical"


class AngleType(StrEnum):
    """Which angle of an entity."""

    HEADING = "heading"
    PITCH = "pitch"
    ROLL = "roll"


class AutomaticGearType(StrEnum):
    """Positions of an automatic gearbox."""

    N = "n"
    P = "p"
    R = "r"
    D = "d"


class LightMode(StrEnum):
    """What a light does."""

    ON = "on"
    OFF = "off"
    FLASHING = "flashing"


class ColorType(StrEnum):
    """Names of colours."""

    OTHER = "other"
    RED = "red"
    YELLOW = "yellow"
    GREEN = "green"
    BLUE = "blue"
    VIOLET = "violet"
    ORANGE = "orange"
    BROWN = "brown"
    BLACK = "black"
    GREY = "grey"
    WHITE = "white"


class VehicleLightType(StrEnum):
    """Lights of a vehicle."""

    DAYTIME_RUNNING_LIGHTS = "daytimeRunningLights"
    LOW_BEAM = "lowBeam"
    HIGH_BEAM = "highBeam"
    FOG_LIGHTS = "fogLights"
    FOG_LIGHTS_FRONT = "fogLightsFront"
    FOG_LIGHTS_REAR = "fogLightsRear"
    BRAKE_LIGHTS = "brakeLights"
    WARNING_LIGHTS = "warningLights"
    INDICATOR_LEFT = "indicatorLeft"
    INDICATOR_RIGHT = "indicatorRight"
    REVERSING_LIGHTS = "reversingLights"
    LICENSE_PLATE_ILLUMINATION = "licensePlateIllumination"
    SPECIAL_PURPOSE_LIGHTS = "specialPurposeLights"


class VehicleComponentType(StrEnum):
    """Moving parts of a vehicle."""

    HOOD = "hood"
    TRUNK = "trunk"
    DOOR_FRONT_RIGHT = "doorFrontRight"
    DOOR_FRONT_LEFT = "doorFrontLeft"
    DOOR_REAR_RIGHT = "doorRearRight"
    DOOR_REAR_LEFT = "doorRearLeft"
    WINDOW_FRONT_RIGHT = "windowFrontRight"
    WINDOW_FRONT_LEFT = "windowFrontLeft"
    WINDOW_REAR_RIGHT = "windowRearRight"
    WINDOW_REAR_LEFT = "windowRearLeft"
    SIDE_MIRRORS = "sideMirrors"
    SIDE_MIRROR_RIGHT = "sideMirrorRight"
    SIDE_MIRROR_LEFT = "sideMirrorLeft"


class PedestrianMotionType(StrEnum):
    """Ways of moving on foot."""

    STANDING = "standing"
    SITTING = "sitting"
    LYING = "lying"
    SQUATTING = "squatting"
    WALKING = "walking"
    RUNNING = "running"
    REELING = "reeling"
    CRAWLING = "crawling"
    CYCLING = "cycling"
    JUMPING = "jumping"
    DUCKING = "ducking"
    BENDING_DOWN = "bendingDown"


class PedestrianGestureType(StrEnum):
    """What the arms do."""

    PHONE_CALL_RIGHT_HAND = "phoneCallRightHand"
    PHONE_CALL_LEFT_HAND = "phoneCallLeftHand"
    PHONE_TEXT_RIGHT_HAND = "phoneTextRightHand"
    PHONE_TEXT_LEFT_HAND = "phoneTextLeftHand"
    WAVING_RIGHT_ARM = "wavingRightArm"
    WAVING_LEFT_ARM = "wavingLeftArm"
    UMBRELLA_RIGHT_HAND = "umbrellaRightHand"
    UMBRELLA_LEFT_HAND = "umbrellaLeftHand"
    CROSS_ARMS = "crossArms"
    COFFEE_RIGHT_HAND = "coffeeRightHand"
    COFFEE_LEFT_HAND = "coffeeLeftHand"
    SANDWICH_RIGHT_HAND = "sandwichRightHand"
    SANDWICH_LEFT_HAND = "sandwichLeftHand"
