"""The kinds of traffic participants: one table, from which everything else about them is derived.

A new kind is an entry of `PARTICIPANTS`, and an entry of `OBJECT_CLASSES` if sensors, drivers or
the analysis of conflicts must tell it apart; its class in ``bridgegen.owl``; and its documentation.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from types import MappingProxyType
from typing import Literal

Conduct = Literal["vehicle", "bicycle", "pedestrian", "animal", "obstacle"]
"""Rules by which a participant moves: those of a motor vehicle, a cyclist, a person on foot …"""


@dataclass(frozen=True)
class Body:
    """A body.

    Attributes:
        length: [m].
        width: [m].
        height: [m].
        center_ahead: of the reference point [m].
        wheelbase: [m]; 0 for what has no axles.
        max_speed: [m/s].
        max_acceleration: [m/s²].
        max_deceleration: [m/s²].
        mass: [kg].
    """

    length: float
    width: float
    height: float
    center_ahead: float = 0.0
    wheelbase: float = 0.0
    max_speed: float = 0.0
    max_acceleration: float = 0.0
    max_deceleration: float = 0.0
    mass: float = 0.0

    @property
    def front(self) -> float:
        """From the reference point to the front [m]."""
        return self.center_ahead + 0.5 * self.length

    @property
    def rear(self) -> float:
        """From the reference point back to the rear [m]."""
        return 0.5 * self.length - self.center_ahead


@dataclass(frozen=True)
class MotionLimits:
    """What bodies can do at most; see `bridgegen.assess.conflict.plausibility` for the sources.

    Attributes:
        acceleration: [m/s²].
        deceleration: [m/s²].
        curvature: of the path of the rear axle [1/m].
        lateral_g: lateral acceleration, as a share of gravity.
        slides: whether it may move across itself.
        is_prop: whether it may stand in another prop.
    """

    acceleration: float = inf
    deceleration: float = inf
    curvature: float = inf
    lateral_g: float = inf
    slides: bool = True
    is_prop: bool = False


@dataclass(frozen=True)
class ObjectClass:
    """What sensors, drivers and the analysis of conflicts tell apart.

    Attributes:
        name: in records and messages.
        conduct: the rules by which it moves.
        mass: [kg] in a collision.
        lamps: luminous intensity of the lamps that it shows [cd].
        reflectance: at 905 nm [1].
        mistaken_for: the name of the class it is taken for where its own is not recognised.
        detection_class: one of `bridgegen.assess.metrics.perception.CLASSES`.
        limits: what its bodies can do at most.
        injury: whose injury curve holds for the persons on or in it, see
            `bridgegen.assess.conflict.severity`; None: there are none.
        hides_people: whether a person may step out from behind it where it stands.
        carla: CARLA's models for it where the server has none that is alike.
    """

    name: str
    conduct: Conduct
    mass: float
    lamps: float
    reflectance: float
    mistaken_for: str
    detection_class: Literal["car", "heavy vehicle", "two-wheeler", "pedestrian", "other"]
    limits: MotionLimits
    injury: Literal["occupant", "pedestrian", "bicycle", "motorcycle"] | None
    hides_people: bool
    carla: tuple[str, ...]


@dataclass(frozen=True)
class Written:
    """How OpenSCENARIO says it.

    Attributes:
        element: the element.
        category: the nearest of the element's categories.
        name: of the element; the category's by default.
        role: of a vehicle.
        is_exact: whether the category says it all; else a property names the kind.
        also: categories that are simulated alike, and read as no kind of ours.
    """

    element: Literal["Vehicle", "Pedestrian", "MiscObject"]
    category: str
    name: str = ""
    role: str | None = None
    is_exact: bool = True
    also: tuple[str, ...] = ()


@dataclass(frozen=True)
class Drawing:
    """How pictures show it.

    Attributes:
        shape: of the outline.
        headlights: whether it lights the road by night.
    """

    shape: Literal["vehicle", "cycle", "person", "cone", "sign", "thing"]
    headlights: bool = False


@dataclass(frozen=True)
class ParticipantKind:
    """A kind of participant, or of what stands at road works.

    Attributes:
        name: in scenario files.
        aliases: other names that scenario files may say.
        body: its size, and what it can do.
        seen_as: what sensors, drivers and the analysis take it for.
        owl_class: its class in the ontology.
        written: how OpenSCENARIO says it.
        drawing: how pictures show it.
        carla: CARLA's models that look like it; empty where CARLA has none.
        takes_part: whether a scenario file may name it; else it is part of road works.
        queues: whether jams are made of it.
        on_rails: whether it cannot leave its course: it is never the ego.
    """

    name: str
    body: Body
    seen_as: ObjectClass
    owl_class: str
    written: Written
    drawing: Drawing
    carla: tuple[str, ...]
    aliases: tuple[str, ...] = ()
    takes_part: bool = True
    queues: bool = False
    on_rails: bool = False


_CAR = ObjectClass(
    name="car",
    conduct="vehicle",
    mass=1500.0,
    lamps=10.0,
    reflectance=0.3,
    mistaken_for="truck",
    detection_class="car",
    limits=MotionLimits(8.0, 11.0, 0.32, 1.0, slides=False),
    injury="occupant",
    hides_people=True,
    carla=("vehicle.tesla.model3", "vehicle.lincoln.mkz_2017", "vehicle.audi.tt"),
)
_TRUCK = ObjectClass(
    name="truck",
    conduct="vehicle",
    mass=16000.0,
    lamps=10.0,
    reflectance=0.3,
    mistaken_for="bus",
    detection_class="heavy vehicle",
    limits=MotionLimits(3.0, 8.0, 0.2, 0.5, slides=False),
    injury="occupant",
    hides_people=True,
    carla=("vehicle.carlamotors.carlacola", "vehicle.carlamotors.firetruck"),
)
_BUS = ObjectClass(
    name="bus",
    conduct="vehicle",
    mass=18000.0,
    lamps=10.0,
    reflectance=0.3,
    mistaken_for="truck",
    detection_class="heavy vehicle",
    limits=MotionLimits(3.0, 8.0, 0.2, 0.5, slides=False),
    injury="occupant",
    hides_people=True,
    carla=(
        "vehicle.mitsubishi.fusorosa",
        "vehicle.volkswagen.t2",
        "vehicle.volkswagen.t2_2021",
    ),
)
_MOTORCYCLE = ObjectClass(
    name="motorcycle",
    conduct="vehicle",
    mass=300.0,
    lamps=5.0,
    reflectance=0.2,
    mistaken_for="bicycle",
    detection_class="two-wheeler",
    limits=MotionLimits(10.0, 11.0, 0.5, 1.0, slides=False),
    injury="motorcycle",
    hides_people=False,
    carla=("vehicle.yamaha.yzf", "vehicle.kawasaki.ninja"),
)
_BICYCLE = ObjectClass(
    name="bicycle",
    conduct="bicycle",
    mass=95.0,
    lamps=2.0,
    reflectance=0.2,
    mistaken_for="motorcycle",
    detection_class="two-wheeler",
    limits=MotionLimits(3.0, 7.0, 1.0, 0.7, slides=False),
    injury="bicycle",
    hides_people=False,
    carla=("vehicle.gazelle.omafiets", "vehicle.bh.crossbike"),
)
_PEDESTRIAN = ObjectClass(
    name="pedestrian",
    conduct="pedestrian",
    mass=75.0,
    lamps=0.0,
    reflectance=0.1,
    mistaken_for="bicycle",
    detection_class="pedestrian",
    limits=MotionLimits(8.0, 8.0),
    injury="pedestrian",
    hides_people=False,
    carla=("walker.pedestrian.0001", "walker.pedestrian.0002"),
)
_ANIMAL = ObjectClass(
    name="animal",
    conduct="animal",
    mass=25.0,
    lamps=0.0,
    reflectance=0.1,
    mistaken_for="pedestrian",
    detection_class="other",
    limits=MotionLimits(13.0, 13.0),
    injury=None,
    hides_people=False,
    carla=("walker.pedestrian.0010", "walker.pedestrian.0012", "walker.pedestrian.0001"),
)
_OTHER = ObjectClass(
    name="other",
    conduct="obstacle",
    mass=50.0,
    lamps=0.0,
    reflectance=0.2,
    mistaken_for="pedestrian",
    detection_class="other",
    limits=MotionLimits(is_prop=True),
    injury=None,
    hides_people=False,
    carla=(
        "static.prop.streetbarrier",
        "static.prop.box01",
        "static.prop.warningconstruction",
    ),
)
_TRAM = ObjectClass(
    name="tram",
    conduct="vehicle",
    mass=32000.0,  # 25 t, see its body, and 100 passengers of 70 kg
    lamps=10.0,
    reflectance=0.3,
    mistaken_for="bus",
    detection_class="heavy vehicle",
    # Ours, above what its source says (1.25 m/s², 2.8 m/s², 18 m): the tightest of street tracks
    # have 10 m, magnetic track brakes add to the wheels' grip.
    limits=MotionLimits(2.5, 5.0, 0.1, 0.5, slides=False),
    injury="occupant",
    hides_people=True,
    carla=_BUS.carla,
)
_E_SCOOTER = ObjectClass(
    name="e-scooter",
    conduct="bicycle",  # eKFV § 10: it goes where bicycles go
    mass=95.0,
    lamps=2.0,  # eKFV § 5: as a bicycle's
    reflectance=0.1,  # its rider's clothes; it is small itself
    mistaken_for="pedestrian",  # its rider stands
    detection_class="two-wheeler",
    limits=MotionLimits(3.0, 7.0, 1.0, 0.7, slides=False),  # as a bicycle's
    injury="bicycle",  # stands in: there is no curve of closing speed for its riders
    hides_people=False,
    carla=_BICYCLE.carla,
)

OBJECT_CLASSES = (
    _CAR,
    _TRUCK,
    _BUS,
    _MOTORCYCLE,
    _BICYCLE,
    _PEDESTRIAN,
    _ANIMAL,
    _OTHER,
    _TRAM,
    _E_SCOOTER,
)
"""Object classes by code, which files record and detectors answer: new ones come last.

CARLA 0.9.13 lacks some models that later ones have, and none has animals, for which a child
stands."""

_ALL = (
    ParticipantKind(
        name="car",
        body=Body(4.6, 1.9, 1.5, 1.4, 2.8, 60.0, 5.0, 9.0, 1500.0),  # a mid-size saloon
        seen_as=_CAR,
        owl_class="Car",
        written=Written("Vehicle", "car"),
        drawing=Drawing("vehicle", headlights=True),
        carla=(
            "vehicle.audi.a2", "vehicle.audi.tt", "vehicle.bmw.grandtourer",
            "vehicle.chevrolet.impala", "vehicle.citroen.c3", "vehicle.dodge.charger_2020",
            "vehicle.lincoln.mkz_2020", "vehicle.mercedes.coupe_2020", "vehicle.micro.microlino",
            "vehicle.nissan.micra", "vehicle.nissan.patrol", "vehicle.nissan.patrol_2021",
            "vehicle.seat.leon", "vehicle.tesla.model3", "vehicle.toyota.prius",
        ),
        queues=True,
    ),
    ParticipantKind(
        name="van",
        body=Body(5.9, 2.0, 2.6, 1.8, 3.6, 45.0, 3.5, 8.0, 3000.0),  # a delivery van
        seen_as=_CAR,
        owl_class="Van",
        written=Written("Vehicle", "van"),
        drawing=Drawing("vehicle", headlights=True),
        carla=("vehicle.mercedes.sprinter", "vehicle.volkswagen.t2_2021"),
        queues=True,
    ),
    ParticipantKind(
        name="truck",
        body=Body(10.0, 2.5, 3.6, 3.4, 5.6, 25.0, 1.5, 6.0, 16000.0),  # two axles
        seen_as=_TRUCK,
        owl_class="Truck",
        written=Written("Vehicle", "truck", also=("semitrailer", "trailer")),
        drawing=Drawing("vehicle", headlights=True),
        carla=("vehicle.carlamotors.carlacola", "vehicle.carlamotors.european_hgv"),
        queues=True,
    ),
    ParticipantKind(
        name="bus",
        body=Body(12.0, 2.55, 3.1, 2.9, 5.9, 28.0, 1.5, 6.0, 18000.0),  # a solo city bus
        seen_as=_BUS,
        owl_class="Bus",
        written=Written("Vehicle", "bus"),
        drawing=Drawing("vehicle", headlights=True),
        carla=("vehicle.mitsubishi.fusorosa",),
        queues=True,
    ),
    ParticipantKind(
        name="motorcycle",
        aliases=("motorbike",),
        body=Body(2.2, 0.8, 1.5, 0.7, 1.45, 60.0, 6.0, 8.0, 300.0),
        seen_as=_MOTORCYCLE,
        owl_class="Motorcycle",
        written=Written("Vehicle", "motorbike"),
        drawing=Drawing("cycle", headlights=True),
        carla=(
            "vehicle.harley-davidson.low_rider", "vehicle.kawasaki.ninja", "vehicle.vespa.zx125",
            "vehicle.yamaha.yzf",
        ),
    ),
    ParticipantKind(
        name="emergency",
        body=Body(6.5, 2.2, 2.9, 2.0, 3.8, 45.0, 3.0, 7.0, 4500.0),  # an ambulance
        seen_as=_CAR,
        owl_class="EmergencyVehicle",
        written=Written("Vehicle", "van", role="ambulance"),
        drawing=Drawing("vehicle", headlights=True),
        carla=("vehicle.ford.ambulance",),
    ),
    ParticipantKind(
        name="bicycle",
        body=Body(1.8, 0.6, 1.8, 0.5, 1.05, 12.0, 1.5, 5.0, 95.0),  # with its rider
        seen_as=_BICYCLE,
        owl_class="Bicycle",
        written=Written("Vehicle", "bicycle"),
        drawing=Drawing("cycle"),
        carla=(
            "vehicle.bh.crossbike", "vehicle.diamondback.century", "vehicle.gazelle.omafiets",
        ),
    ),
    ParticipantKind(
        name="e-scooter",
        # With its rider, who stands on it. eKFV § 1: 20 km/h, 2.0 m by 0.7 m and 55 kg at most;
        # § 4: brakes of 3.5 m/s² at least. Of common models, rounded: 1.2 m and 20 kg.
        body=Body(1.2, 0.6, 1.9, 0.45, 0.9, 5.56, 1.5, 3.5, 95.0),
        seen_as=_E_SCOOTER,
        owl_class="EScooter",
        written=Written("Vehicle", "bicycle", name="e-scooter", is_exact=False),
        drawing=Drawing("cycle"),
        carla=(
            "vehicle.bh.crossbike", "vehicle.diamondback.century", "vehicle.gazelle.omafiets",
        ),
    ),
    ParticipantKind(
        name="tram",
        # Two sections on a bogie each, 18.6 m, 2.4 m, 3.6 m, 25 t empty, 70 km/h, 1.25 m/s², in an
        # emergency 2.8 m/s² (Astra Autentic; Railway Gazette, "Astra develops Autentic low-floor
        # tram"). One rigid body here; the bogies are taken to be half its length apart.
        body=Body(18.6, 2.4, 3.6, 4.65, 9.3, 19.4, 1.25, 2.8, 32000.0),
        seen_as=_TRAM,
        owl_class="Tram",
        written=Written("Vehicle", "tram"),
        drawing=Drawing("vehicle", headlights=True),
        carla=(),
        on_rails=True,
    ),
    ParticipantKind(
        name="pedestrian",
        body=Body(0.5, 0.6, 1.75, max_speed=4.0, mass=75.0),
        seen_as=_PEDESTRIAN,
        owl_class="Pedestrian",
        written=Written("Pedestrian", "pedestrian"),
        drawing=Drawing("person"),
        carla=("walker.pedestrian.0001", "walker.pedestrian.0010", "walker.pedestrian.0012"),
    ),
    ParticipantKind(
        name="animal",
        body=Body(1.2, 0.4, 0.9, max_speed=12.0, mass=25.0),  # a roe deer
        seen_as=_ANIMAL,
        owl_class="Animal",
        written=Written("Pedestrian", "animal"),
        drawing=Drawing("person"),
        carla=(),
    ),
    ParticipantKind(
        name="obstacle",
        body=Body(1.0, 1.0, 1.0, mass=50.0),
        seen_as=_OTHER,
        owl_class="Misc",
        written=Written("MiscObject", "obstacle", name="misc"),
        drawing=Drawing("thing"),
        carla=(
            "static.prop.barrel", "static.prop.box01", "static.prop.haybale",
            "static.prop.container",
        ),
    ),
    ParticipantKind(
        name="cone",
        body=Body(0.4, 0.4, 0.75, mass=4.0),  # 75 cm, as on fast roads
        seen_as=_OTHER,
        owl_class="RoadCone",
        written=Written("MiscObject", "obstacle", name="roadcone"),
        drawing=Drawing("cone"),
        carla=(
            "static.prop.constructioncone", "static.prop.trafficcone01",
            "static.prop.trafficcone02",
        ),
        takes_part=False,
    ),
    ParticipantKind(
        name="sign",
        body=Body(0.1, 0.9, 2.2, mass=20.0),  # a warning triangle on a post
        seen_as=_OTHER,
        owl_class="ConstructionCard",
        written=Written("MiscObject", "pole", name="constructioncard"),
        drawing=Drawing("sign"),
        carla=("static.prop.warningconstruction",),
        takes_part=False,
    ),
)  # fmt: skip

PARTICIPANTS: Mapping[str, ParticipantKind] = MappingProxyType({kind.name: kind for kind in _ALL})
"""Kinds of participants by name. The dimensions are those of common models, rounded; accelerations
are what such bodies reach on a dry road. Reference point: the rear axle's centre of a vehicle, the
centre of anything else."""

TYPES = tuple(kind.name for kind in _ALL if kind.takes_part)
"""Types of participants."""

_NAMES = {alias: kind.name for kind in _ALL for alias in (kind.name, *kind.aliases)}

TYPE_NAMES = tuple(
    alias for kind in _ALL if kind.takes_part for alias in (kind.name, *kind.aliases)
)
"""Types of participants, with all names that a scenario file may give."""

QUEUES = tuple(kind.name for kind in _ALL if kind.queues)
"""Types of vehicles that a jam may consist of."""


def canonical(name: str) -> str:
    """Return the one name of a kind, of which a scenario file may say another."""
    return _NAMES[name]


def drawing_of(name: str) -> Drawing:
    """Return how pictures show a kind; what is unknown is a vehicle."""
    kind = PARTICIPANTS.get(name)
    return Drawing("vehicle", headlights=True) if kind is None else kind.drawing
