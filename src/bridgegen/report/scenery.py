"""What is drawn of a concrete scenario besides its motion: the road, the bodies, the lights."""

from collections.abc import Mapping

from bridgegen.arrays import Float
from bridgegen.openx.opendrive.outline import outline
from bridgegen.openx.opendrive.outline_furniture import Light, lights
from bridgegen.pipeline import Pipeline
from bridgegen.report.data import Entity, Lamp, Outline
from bridgegen.simulation.rollout import Rollout


class Scenery:
    """The drawings of a pipeline's road networks, each made once.

    Args:
        pipeline: whose scenarios are drawn.
    """

    def __init__(self, pipeline: Pipeline) -> None:
        self._pipeline = pipeline
        self._known: dict[bytes, tuple[tuple[Outline, ...], list[Light]]] = {}

    def road(self, x: Float) -> tuple[tuple[Outline, ...], list[Light]]:
        """Return the drawing of a row's road network, the same objects for the same network."""
        space, source = self._pipeline.space, self._pipeline.source
        key = x[[space.index(name) for name in source.static_names]].tobytes()
        if key not in self._known:
            model = self._pipeline.concrete(x).roads
            shapes = (Outline(kind, points) for kind, points in outline(model, source.junction))
            self._known[key] = tuple(shapes), lights(model)
        return self._known[key]


def bodies(rollout: Rollout, types: Mapping[str, str]) -> tuple[Entity, ...]:
    """Return the bodies of a rollout, each as what it is (`Source.bodies`)."""
    return tuple(
        Entity(name, length, width, ahead, types.get(name, "obstacle"))
        for name, (length, width, ahead) in zip(rollout.names, rollout.box.tolist(), strict=True)
    )


def lamps(rollout: Rollout, row: int, found: list[Light]) -> tuple[Lamp, ...]:
    """Return the lights that change in one scenario of a rollout, with what they show."""
    shown = {name: number for number, name in enumerate(rollout.light_names)}
    return tuple(
        Lamp(one.x, one.y, one.h, rollout.lights[row, shown[one.id]])
        for one in found
        if one.id in shown
    )
