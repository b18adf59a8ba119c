"""CARLA's bodies: which of its blueprints stands for a participant.

The blueprint is the nearest in length, width and height of those that look like what is meant.
Its sizes, not the file's, are what bodies in CARLA touch with.

Source: ids and sizes of CARLA 0.9.15 and 0.9.16 as Scenic 3 lists them, which read them from the
server (scenic/simulators/carla/_blueprintData.py). Mirrors count where CARLA counts them.
"""

import math
from collections.abc import Mapping
from typing import Any

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.bodies import kind_of
from bridgegen.scenario.participants import PARTICIPANTS

Sizes = Mapping[str, tuple[float, float, float]]
"""Length, width and height [m] by blueprint."""

SIZES: Sizes = {
    "vehicle.audi.a2": (3.71, 1.79, 1.55),
    "vehicle.audi.tt": (4.18, 1.99, 1.39),
    "vehicle.bmw.grandtourer": (4.61, 2.24, 1.67),
    "vehicle.chevrolet.impala": (5.36, 2.03, 1.41),
    "vehicle.citroen.c3": (3.99, 1.85, 1.62),
    "vehicle.dodge.charger_2020": (5.01, 1.88, 1.53),
    "vehicle.lincoln.mkz_2020": (4.89, 1.84, 1.49),
    "vehicle.mercedes.coupe_2020": (4.67, 1.81, 1.44),
    "vehicle.micro.microlino": (2.21, 1.48, 1.38),
    "vehicle.nissan.micra": (3.63, 1.85, 1.50),
    "vehicle.nissan.patrol": (4.60, 1.93, 1.85),
    "vehicle.nissan.patrol_2021": (5.57, 2.15, 2.05),
    "vehicle.seat.leon": (4.19, 1.82, 1.47),
    "vehicle.tesla.model3": (4.79, 2.16, 1.49),
    "vehicle.toyota.prius": (4.51, 2.01, 1.52),
    "vehicle.mercedes.sprinter": (5.92, 1.99, 2.56),
    "vehicle.volkswagen.t2_2021": (4.44, 1.77, 1.99),
    "vehicle.carlamotors.carlacola": (5.20, 2.63, 2.47),
    "vehicle.carlamotors.european_hgv": (7.94, 2.89, 3.46),
    "vehicle.mitsubishi.fusorosa": (10.27, 3.94, 4.25),
    "vehicle.harley-davidson.low_rider": (2.35, 0.77, 1.65),
    "vehicle.kawasaki.ninja": (2.04, 0.80, 1.52),
    "vehicle.vespa.zx125": (1.82, 0.87, 1.59),
    "vehicle.yamaha.yzf": (2.19, 0.87, 1.53),
    "vehicle.bh.crossbike": (1.51, 0.87, 1.61),
    "vehicle.diamondback.century": (1.66, 0.58, 1.62),
    "vehicle.gazelle.omafiets": (1.84, 0.66, 1.78),
    "vehicle.ford.ambulance": (6.37, 2.35, 2.43),
    "vehicle.carlamotors.firetruck": (8.47, 2.89, 3.83),
    "vehicle.dodge.charger_police_2020": (5.24, 1.93, 1.64),
    "walker.pedestrian.0001": (0.38, 0.38, 1.86),
    "walker.pedestrian.0010": (0.50, 0.50, 1.10),
    "walker.pedestrian.0012": (0.38, 0.38, 1.30),
    "static.prop.barrel": (0.46, 0.47, 0.81),
    "static.prop.box01": (0.65, 0.65, 0.69),
    "static.prop.haybale": (1.25, 1.19, 1.19),
    "static.prop.container": (1.93, 1.01, 1.71),
    "static.prop.streetbarrier": (1.21, 0.37, 1.07),
    "static.prop.chainbarrier": (1.49, 0.24, 0.89),
    "static.prop.streetsign": (1.06, 0.13, 2.15),
    "static.prop.plantpot06": (1.59, 1.59, 0.85),
    "static.prop.plantpot07": (0.49, 0.48, 0.56),
    "static.prop.constructioncone": (0.34, 0.34, 0.59),
    "static.prop.trafficcone01": (0.88, 0.88, 1.13),
    "static.prop.trafficcone02": (0.46, 0.39, 1.18),
    "static.prop.warningconstruction": (1.31, 1.06, 1.86),
}
"""Length, width and height [m] of all models that stand for something."""

SERVICE: Mapping[osc.Role, tuple[str, ...]] = {
    osc.Role.AMBULANCE: PARTICIPANTS["emergency"].carla,
    osc.Role.FIRE: ("vehicle.carlamotors.firetruck",),
    osc.Role.POLICE: ("vehicle.dodge.charger_police_2020",),
}
OBJECTS: Mapping[osc.MiscObjectCategory, tuple[str, ...]] = {
    # of barriers ScenarioRunner takes this one, whatever the file says
    osc.MiscObjectCategory.BARRIER: ("static.prop.streetbarrier",),
    osc.MiscObjectCategory.RAILING: ("static.prop.chainbarrier",),
    osc.MiscObjectCategory.POLE: ("static.prop.streetsign",),
    osc.MiscObjectCategory.VEGETATION: ("static.prop.plantpot06", "static.prop.plantpot07"),
}
"""Objects that are no kind of participant; those name their blueprints themselves."""


def blueprint(body: osc.Vehicle | osc.Pedestrian | osc.MiscObject) -> str | None:
    """Return the blueprint that stands for a body; None where CARLA has nothing like it.

    Args:
        body: without references to parameters.
    """
    box: Any = body.bounding_box.dimensions
    return next(iter(ranked(body, (box.length, box.width, box.height))), None)


def ranked(
    body: osc.Vehicle | osc.Pedestrian | osc.MiscObject, size: tuple[float, float, float]
) -> list[str]:
    """Return all blueprints that look like a body, the nearest in size first.

    Args:
        body: of which its size is not looked at.
        size: length, width and height [m].
    """
    return sorted(_alike(body), key=lambda name: math.dist(SIZES[name], size))


def _alike(body: osc.Vehicle | osc.Pedestrian | osc.MiscObject) -> tuple[str, ...]:
    role: Any = body.role if isinstance(body, osc.Vehicle) else None
    if role in SERVICE:
        return SERVICE[role]
    kind = kind_of(body)
    if kind is not None:
        return kind.carla
    category: Any = body.misc_object_category if isinstance(body, osc.MiscObject) else None
    return OBJECTS.get(category, ())
