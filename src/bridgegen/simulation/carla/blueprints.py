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

CHOICES: Mapping[int, tuple[str, ...]] = {
    CAR: (
        "vehicle.lincoln.mkz_2017", "vehicle.lincoln.mkz_2020", "vehicle.tesla.model3",
        "vehicle.audi.tt", "vehicle.toyota.prius",
    ),
    TRUCK: ("vehicle.carlamotors.carlacola", "vehicle.carlamotors.firetruck"),
    BUS: ("vehicle.mitsubishi.fusorosa", "vehicle.volkswagen.t2", "vehicle.volkswagen.t2_2021"),
    MOTORBIKE: ("vehicle.kawasaki.ninja", "vehicle.yamaha.yzf"),
    BICYCLE: ("vehicle.bh.crossbike", "vehicle.diamondback.century", "vehicle.gazelle.omafiets"),
    PEDESTRIAN: ("walker.pedestrian.0001", "walker.pedestrian.0002"),
    ANIMAL: ("walker.pedestrian.0009", "walker.pedestrian.0010", "walker.pedestrian.0001"),
    OTHER: ("static.prop.streetbarrier", "static.prop.warningconstruction", "static.prop.box01"),
}  # fmt: skip
"""By kind, the best first; which of them there are differs between CARLA 0.9.13 and 0.9.16. There
are no animals: a child stands for one."""


def choose(kind: int, model: str, known: Collection[str]) -> str:
    """Return the blueprint for a participant.

    Args:
        kind: what it is, see `bridgegen.ego.kinds`.
        model: the name of its entry in the storyboard, which may be a blueprint's.
        known: the blueprints that the server has.

    Raises:
        InputError: it has none that would do.
    """
    if model in known:
        return model
    for one in CHOICES[kind]:
        if one in known:
            return one
    raise InputError(
        f"carla: the server must have a blueprint for a {NAMES[kind]}, and has none of "
        f"{', '.join(CHOICES[kind])}"
    )
