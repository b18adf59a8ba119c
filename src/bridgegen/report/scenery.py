"""What is drawn of a concrete scenario besides its motion: the road, the bodies, the lights."""

import numpy as np

from bridgegen.odd.story import Story
from bridgegen.ontology.graph import Individuals
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

    def road(
        self, values: dict[str, float], individuals: Individuals
    ) -> tuple[tuple[Outline, ...], list[Light]]:
        """Return the drawing of a scenario's road network, the same objects for the same network.

        Args:
            values: of every parameter.
            individuals: the scenario's.
        """
        pipeline = self._pipeline
        static = [] if pipeline.road_map else [values[name] for name in pipeline.static_names]
        key = np.array(static).tobytes()
        if key not in self._known:
            model = pipeline.roads(individuals)
            junction = pipeline.road_map.site.junction_id if pipeline.road_map else None
            shapes = tuple(Outline(kind, points) for kind, points in outline(model, junction))
            self._known[key] = shapes, lights(model)
        return self._known[key]


def bodies(rollout: Rollout, story: Story) -> tuple[Entity, ...]:
    """Return the bodies of a rollout, each as what it is."""
    types = {one.name: one.type for one in story.participants}
    for works in story.works:
        types |= {f"{works.name}_cone_{k}": "cone" for k in range(1, len(works.cones) + 1)}
        types[f"{works.name}_sign"] = "sign"
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
