"""Models that scenario files may name: the bodies of test targets and design vehicles.

What a source does not say (what a body can do, a rider's height) is as of the model's type.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

from bridgegen.scenario.participants import PARTICIPANTS, Body

NCAP = "the vehicles and pedestrians of OSC-NCAP-scenarios (Vector, 2026), after ISO 19206"
AASHTO = "AASHTO, A Policy on Geometric Design of Highways and Streets, 2004, exhibit 2-1"
COMMONROAD = "Althoff and Würsching, CommonRoad: Vehicle Models"


@dataclass(frozen=True)
class NamedModel:
    """A model.

    Attributes:
        name: in scenario files.
        type: what it is, one of `bridgegen.scenario.participants.TYPES`.
        body: its size, and what it can do.
        source: of its dimensions.
    """

    name: str
    type: str
    body: Body
    source: str


def _model(name: str, kind: str, source: str, **said: float) -> NamedModel:
    return NamedModel(name, kind, replace(PARTICIPANTS[kind].body, **said), source)


def _design_vehicle(
    name: str, kind: str, size: tuple[float, float, float], wheelbase: float, rear: float
) -> NamedModel:
    """Return a design vehicle by length, width and height, wheelbase and rear overhang [m]."""
    length, width, height = size
    return _model(
        name,
        kind,
        AASHTO,
        length=length,
        width=width,
        height=height,
        wheelbase=wheelbase,
        center_ahead=round(0.5 * length - rear, 3),
    )


_ALL = (
    _model(
        "ncap_global_vehicle_target", "car", NCAP,
        length=4.023, width=1.712, height=1.427, center_ahead=1.328, wheelbase=2.475,
    ),
    _model(
        "ncap_small_obstruction_vehicle", "car", NCAP,
        length=4.316, width=1.79, height=1.48, center_ahead=1.368, wheelbase=2.638,
    ),
    _model(
        "ncap_large_obstruction_vehicle", "car", NCAP,
        length=4.418, width=1.82, height=1.533, center_ahead=1.399, wheelbase=2.703,
    ),
    _model(
        "vw_golf_sportsvan_2015", "car", NCAP,
        length=4.358, width=1.815, height=1.577, center_ahead=1.349, wheelbase=2.67,
    ),
    _model(
        "ncap_motorcycle", "motorcycle", NCAP,
        length=2.08, width=0.79, center_ahead=0.673, wheelbase=1.41,
    ),
    _model(
        "ncap_bicycle", "bicycle", NCAP,
        length=1.89, width=0.5, center_ahead=0.605, wheelbase=1.21,
    ),
    _model("ncap_adult", "pedestrian", NCAP, length=0.6, width=0.5, height=1.8),
    _model("ncap_child", "pedestrian", NCAP, length=0.711, width=0.298, height=1.154),
    _design_vehicle("aashto_p", "car", (5.8, 2.1, 1.3), 3.4, 1.5),
    _design_vehicle("aashto_su", "truck", (9.2, 2.4, 4.1), 6.1, 1.8),
    _design_vehicle("aashto_city_bus", "bus", (12.2, 2.6, 3.2), 7.6, 2.4),
    _design_vehicle("aashto_s_bus_11", "bus", (10.9, 2.4, 3.2), 6.5, 3.7),
    _model(
        "commonroad_ford_escort", "car", COMMONROAD, length=4.298, width=1.674,
        center_ahead=1.509, wheelbase=2.393, max_speed=45.8, mass=1225.9,
    ),
    _model(
        "commonroad_bmw_320i", "car", COMMONROAD, length=4.508, width=1.61,
        center_ahead=1.423, wheelbase=2.579, max_speed=50.8, mass=1093.3,
    ),
)  # fmt: skip

MODELS: Mapping[str, NamedModel] = MappingProxyType({model.name: model for model in _ALL})
"""Named models of participants, by name."""


def type_of(name: str) -> str:
    """Return the type of what a type's or a model's name says."""
    return MODELS[name].type if name in MODELS else name


def body_of(name: str) -> Body:
    """Return the body of what a type's or a model's name says."""
    return MODELS[name].body if name in MODELS else PARTICIPANTS[name].body
