"""What CARLA itself notices: contacts of the ego, lane markings that it crosses; and red lights."""

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bridgegen.adapters.carla.stage import Stage
from bridgegen.simulation.rollout import Incident, Rollout

if TYPE_CHECKING:
    import carla

LASTING = 20
"""A contact with the same actor within so many instants (1 s) of another is the same one."""

ASIDE = 2.0
"""A stop line applies to vehicles that cross it within this distance of its point [m]."""

COLLISION, LANE_INVASION, RED_LIGHT = "collision", "lane invasion", "red light"
RED, RED_AND_YELLOW = 1, 2  # of Rollout.lights


class Incidents:
    """Records the events of the ego's collision sensor and lane detector in one row.

    Args:
        stage: with the ego; the sensors are attached to it.
        names: of the entities.
    """

    def __init__(self, stage: Stage, names: tuple[str, ...]) -> None:
        import carla

        self._who = {body.id: name for body, name in zip(stage.bodies, names, strict=True)}
        self._told: list[tuple[int, str, str]] = []
        self._first = 0
        here = carla.Transform()
        stage.attach("sensor.other.collision", here).listen(self._collided)
        stage.attach("sensor.other.lane_invasion", here).listen(self._invaded)

    def begin(self, frame: int) -> None:
        """Have instant 0 be that of a frame of CARLA's."""
        self._first = frame

    def reached(self, k: int, snapshot: "carla.WorldSnapshot") -> None:
        """See `RowObserver`: the sensors report by themselves."""

    def _collided(self, event: Any) -> None:
        other = event.other_actor
        self._told.append((event.frame, COLLISION, self._who.get(other.id, other.type_id)))

    def _invaded(self, event: Any) -> None:
        kinds = {str(one.type) for one in event.crossed_lane_markings}
        self._told.append((event.frame, LANE_INVASION, ", ".join(sorted(kinds))))

    def all(self, rollout: Rollout) -> tuple[Incident, ...]:
        """Return them in the order in which they took place; a lasting incident is listed once.

        Args:
            rollout: of this row, N = 1.
        """
        found = red_lights(rollout)
        last: dict[str, int] = {}
        for frame, kind, what in sorted(set(self._told)):
            k = frame - self._first
            if k < 0:  # when it settled
                continue
            if kind != COLLISION or k - last.get(what, -LASTING - 1) > LASTING:
                found.append(Incident(k, kind, what))
            if kind == COLLISION:
                last[what] = k
        return tuple(sorted(found, key=lambda one: one.step))


def red_lights(rollout: Rollout) -> list[Incident]:
    """Return where the ego's front crosses the stop line of a light that is red; N = 1."""
    n, front = int(rollout.n_steps[0]), rollout.box[0, 2] + 0.5 * rollout.box[0, 0]
    h = rollout.h[0, 0, :n]
    x = rollout.x[0, 0, :n] + front * np.cos(h)
    y = rollout.y[0, 0, :n] + front * np.sin(h)
    found = []
    for j in np.flatnonzero(rollout.stop_entities == 0).tolist():
        line_x, line_y, line_h = rollout.stop_lines[0, j]
        c, s = np.cos(line_h), np.sin(line_h)
        past = (x - line_x) * c + (y - line_y) * s
        beside = np.abs((y - line_y) * c - (x - line_x) * s) <= ASIDE
        light = int(rollout.stop_lights[j])
        for k in (np.flatnonzero((past[:-1] <= 0.0) & (past[1:] > 0.0) & beside[1:]) + 1).tolist():
            if rollout.lights[0, light, k - 1] in (RED, RED_AND_YELLOW):
                found.append(Incident(k, RED_LIGHT, rollout.light_names[light]))
    return found


def write_incidents(folder: Path, incidents: Sequence[Incident], time_step: float) -> None:
    """Write a row's incidents into its folder, as ``incidents.csv``."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "incidents.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(("frame", "time", "kind", "what"))
        writer.writerows(
            (one.step, round(one.step * time_step, 6), one.kind, one.what) for one in incidents
        )
