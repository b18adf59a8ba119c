"""Which of CARLA's models stands for which participant."""

from collections.abc import Collection, Mapping

from bridgegen.ego.kinds import (
    ANIMAL,
    BICYCLE,
    BUS,
    CAR,
    MOTORBIKE,
    NAMES,
    OTHER,
    PEDESTRIAN,
    TRUCK,
)
from bridgegen.errors import InputError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.scenario_runner.blueprints import ranked

SPARE: Mapping[int, tuple[str, ...]] = {
    CAR: ("vehicle.tesla.model3", "vehicle.lincoln.mkz_2017", "vehicle.audi.tt"),
    TRUCK: ("vehicle.carlamotors.carlacola", "vehicle.carlamotors.firetruck"),
    BUS: ("vehicle.mitsubishi.fusorosa", "vehicle.volkswagen.t2", "vehicle.volkswagen.t2_2021"),
    MOTORBIKE: ("vehicle.yamaha.yzf", "vehicle.kawasaki.ninja"),
    BICYCLE: ("vehicle.gazelle.omafiets", "vehicle.bh.crossbike"),
    PEDESTRIAN: ("walker.pedestrian.0001", "walker.pedestrian.0002"),
    ANIMAL: ("walker.pedestrian.0010", "walker.pedestrian.0012", "walker.pedestrian.0001"),
    OTHER: ("static.prop.streetbarrier", "static.prop.box01", "static.prop.warningconstruction"),
}
"""By kind, where the server has nothing that is alike: CARLA 0.9.13 lacks some models that later
ones have, and none has animals, for which a child stands."""


def choose(
    body: object, kind: int, size: tuple[float, float, float], known: Collection[str]
) -> str:
    """Return the blueprint for a participant: the one that it is named by, or the nearest in size.

    Args:
        body: its entry in the storyboard.
        kind: what it is, see `bridgegen.ego.kinds`.
        size: length, width and height [m].
        known: the blueprints that the server has.

    Raises:
        InputError: it has none that would do.
    """
    named = str(getattr(body, "name", ""))
    alike = (
        ranked(body, size)
        if isinstance(body, osc.Vehicle | osc.Pedestrian | osc.MiscObject)
        else []
    )
    for one in (named, *alike, *SPARE[kind]):
        if one in known:
            return one
    raise InputError(
        f"carla: the server must have a blueprint for a {NAMES[kind]}, and has none of "
        f"{', '.join(dict.fromkeys((*alike, *SPARE[kind])))}"
    )
