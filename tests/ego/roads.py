"""Road networks of the catalogue, and the same turned and moved as a whole."""

import math
from dataclasses import replace
from functools import cache

import numpy as np

from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.routes import Route
from bridgegen.scenario.language.reader import load


@cache
def network_of(scenario: str) -> tuple[OpenDrive, Route]:
    """Return the nominal road network of a scenario, and the ego's route."""
    logical = load(scenario)
    pipeline = Pipeline(logical, logical.space(), PipelineOptions(ego="route-follower"))
    middle = pipeline.space.decode(np.full((1, pipeline.space.n_var), 0.5))
    networks, _ = pipeline.runner.roads_of(middle)
    return networks._models[0], networks._ways[0].routes[0]


def moved(model: OpenDrive, angle: float, dx: float, dy: float) -> OpenDrive:
    """Return a road network turned about the origin and then moved."""
    c, s = math.cos(angle), math.sin(angle)
    roads = [
        replace(
            road,
            plan_view=tuple(
                replace(
                    one, x=c * one.x - s * one.y + dx, y=s * one.x + c * one.y + dy,
                    hdg=one.hdg + angle,
                )
                for one in road.plan_view
            ),
        )
        for road in model.roads
    ]  # fmt: skip
    return replace(model, roads=tuple(roads))
