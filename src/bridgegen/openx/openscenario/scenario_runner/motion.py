"""Timed poses of participants for ScenarioRunner.

Its frame is the standard's: it turns y and headings to CARLA's left-handed frame itself, in files
whose description does not begin with ``CARLA:``. A place is CARLA's: of a vehicle or an object the
middle of its box on the ground, of a walker the middle of its capsule.

Source: ScenarioRunner 0.9.16, srunner/tools/openscenario_parser.py, convert_position_to_transform.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.recorded import Recording

Body = osc.Vehicle | osc.Pedestrian | osc.MiscObject


@dataclass(frozen=True)
class Course:
    """The positions of a box's middle at K evenly spaced instants.

    Attributes:
        x: ``(K,)`` [m].
        y: ``(K,)`` [m].
        z: of CARLA's reference point [m], as at the start.
        h: ``(K,)`` [rad], continuous.
        time_step: between two instants [s].
    """

    x: Float
    y: Float
    z: float
    h: Float
    time_step: float

    @property
    def moves(self) -> bool:
        """Whether it leaves its start."""
        return any(np.ptp(one) > 0.0 for one in (self.x, self.y, self.h))

    @property
    def duration(self) -> float:
        """From the first instant to the last [s]."""
        return (len(self.x) - 1) * self.time_step

    def position(self, k: int) -> osc.Position:
        """Return the place at an instant."""
        x, y, h = (float(one[k]) for one in (self.x, self.y, self.h))
        return osc.Position(osc.WorldPosition(x, y, z=self.z, h=h))

    def trajectory(self, name: str) -> osc.FollowTrajectoryAction:
        """Return the action that follows it: a vertex for each instant, two where nothing moves."""
        shape = osc.Shape(osc.Polyline(tuple(self._vertices())))
        return osc.FollowTrajectoryAction(
            osc.TimeReference(osc.Timing(osc.ReferenceContext.RELATIVE, 1.0, 0.0)),
            osc.TrajectoryFollowingMode(osc.FollowingMode.POSITION),
            osc.TrajectoryRef(osc.Trajectory(name, False, shape)),
        )

    def _vertices(self) -> Iterator[osc.Vertex]:
        last = len(self.x) - 1
        for k in range(last + 1) if self.moves else (0, last):
            yield osc.Vertex(self.position(k), k * self.time_step)


def course(recording: Recording, e: int, body: Body, ground: float = 0.0) -> Course:
    """Return an entity's course: the one place where reference points become boxes' middles.

    Args:
        recording: of reference points.
        e: which entity.
        body: its own, without references to parameters.
        ground: how high its start lies [m]; recordings are flat.
    """
    centre: Any = body.bounding_box.center
    x, y, h = recording.x[e], recording.y[e], recording.h[e]
    cos, sin = np.cos(h), np.sin(h)
    return Course(
        x + centre.x * cos - centre.y * sin,
        y + centre.x * sin + centre.y * cos,
        ground + (float(centre.z) if isinstance(body, osc.Pedestrian) else 0.0),
        h,
        recording.time_step,
    )


def centred(body: Body, name: str) -> Body:
    """Return a body of version 1.0 whose reference point is the middle of its box on the ground.

    Args:
        body: without references to parameters.
        name: CARLA's blueprint.
    """
    centre: Any = body.bounding_box.center
    z = 0.0 if isinstance(body, osc.Pedestrian) else centre.z
    box = replace(body.bounding_box, center=osc.Center(0.0, 0.0, z))
    none = osc.Properties()
    if isinstance(body, osc.Vehicle):
        axles = _moved(body.axles, -centre.x)
        return osc.Vehicle(name, body.vehicle_category, box, body.performance, axles, none)
    if isinstance(body, osc.Pedestrian):
        kind = body.pedestrian_category
        return osc.Pedestrian(name, kind, body.mass, box, none, model=name)
    return osc.MiscObject(name, body.misc_object_category, body.mass, box, none)


def _moved(axles: osc.Axles, by: float) -> osc.Axles:
    def moved(one: osc.Axle) -> osc.Axle:
        x: Any = one.position_x
        return replace(one, position_x=x + by)

    return osc.Axles(
        moved(axles.front or axles.rear), moved(axles.rear), tuple(map(moved, axles.additional))
    )
