"""A controller for CARLA's ScenarioRunner: timed trajectories, and an initial speed.

BridgeGen puts this file beside the scenarios that it exports; they name it as their controllers'
``module``. It needs ScenarioRunner 0.9.15 or newer and nothing of BridgeGen.

- An actor with a trajectory is, at each of its times, where the trajectory says, on its lane or
  off it: vehicles by their velocity, pedestrians by their walk, other things by their place. Who is
  pushed away from there is let go.
- An actor without one, the ego, gets its initial speed once and is then left to its driver.
- With the property ``traffic_lights`` "stand", CARLA's own programme of the lights stands still
  while the scenario runs, so that the states that the scenario sets last.
- ``duration`` is the last vertex's time [s]: ScenarioRunner 0.9.15 does not pass the times on, so
  there they follow from it, for vertices are evenly spaced in time.
- Properties ``weather.FIELD`` are fields of ``carla.WeatherParameters``; they replace what
  ScenarioRunner makes of the scenario's weather at its start.
"""

from __future__ import annotations

import bisect
from typing import Any

import carla
from srunner.scenariomanager.actorcontrols.basic_control import BasicControl
from srunner.scenariomanager.carla_data_provider import CarlaDataProvider
from srunner.scenariomanager.timer import GameTime

from bridgegen.base import elementary

LET_GO = 2.0
"""Deviation beyond which a participant has been pushed, and is steered no more [m]."""

PULL = 0.5
"""Share of a deviation that is corrected in one step."""

_WEATHER = "weather."
_USUAL_STEP = 0.05  # [s], before the first step is known
_STANDING = 1e-3  # [m/s]


class BridgegenControl(BasicControl):  # type: ignore[misc]  # not typed
    """See the module.

    Args:
        actor: a ``carla.Actor``.
        args: the controller's properties.
    """

    _actor: Any
    _init_speed: bool

    def __init__(self, actor: carla.Actor, args: dict[str, str] | None = None) -> None:
        super().__init__(actor)
        args = args or {}
        self._lights_stand = args.get("traffic_lights") == "stand"
        self._weather = {
            name[len(_WEATHER) :]: float(value)
            for name, value in args.items()
            if name.startswith(_WEATHER)
        }
        self._duration = float(args.get("duration", "nan"))
        self._ticks = 0
        self._began: float | None = None
        self._before: float | None = None
        self._is_let_go = False

    def update_waypoints(
        self,
        waypoints: list[carla.Transform],
        times: list[float] | None = None,
        start_time: float | None = None,
    ) -> None:
        """Take a trajectory, which begins with the next step."""
        super().update_waypoints(waypoints)
        last = max(len(waypoints) - 1, 1)
        evenly = [self._duration * i / last for i in range(len(waypoints))]
        self._times = list(times) if times else evenly
        self._began, self._reached_goal, self._is_let_go = None, False, False

    def reset(self) -> None:
        """Release the actor, and let CARLA's lights continue."""
        if self._lights_stand and self._ticks:
            CarlaDataProvider.get_world().freeze_all_traffic_lights(False)
        self._actor = None

    def run_step(self) -> None:
        """Command the actor for the coming step of the simulation."""
        if not self._actor or not self._actor.is_alive:
            return
        now = GameTime.get_time()
        self._ticks += 1
        self._set_up_world()
        if self._waypoints and self._times and not self._reached_goal:
            self._follow(now)
        elif self._init_speed:
            forward = self._actor.get_transform().get_forward_vector()
            self._actor.set_target_velocity(forward * self._target_speed)
            self._init_speed = False
        self._before = now

    def _set_up_world(self) -> None:
        if self._ticks == 1 and self._lights_stand:
            CarlaDataProvider.get_world().freeze_all_traffic_lights(True)
        if self._ticks == 2 and self._weather:  # ScenarioRunner has set its own by now
            world = CarlaDataProvider.get_world()
            weather = world.get_weather()
            for name, value in self._weather.items():
                setattr(weather, name, value)
            world.set_weather(weather)

    def _follow(self, now: float) -> None:
        if self._began is None:
            self._began = now
        time, step = now - self._began, self._step(now)
        if time > self._times[-1] - 0.5 * step:
            self._reached_goal = True
        if self._reached_goal or self._is_let_go:
            return
        here = self._actor.get_transform()
        x, y, yaw = self._pose(time)
        next_x, next_y, next_yaw = self._pose(time + step)
        off_x, off_y = x - here.location.x, y - here.location.y
        if elementary.hypot(off_x, off_y) > LET_GO:
            self._is_let_go = True
            return
        vx = (next_x - x + PULL * off_x) / step
        vy = (next_y - y + PULL * off_y) / step
        if isinstance(self._actor, carla.Vehicle):
            turn = _turn(next_yaw - yaw) + PULL * _turn(yaw - here.rotation.yaw)
            falling = self._actor.get_velocity().z
            self._actor.set_target_velocity(carla.Vector3D(vx, vy, falling))
            self._actor.set_target_angular_velocity(carla.Vector3D(0.0, 0.0, turn / step))
        elif isinstance(self._actor, carla.Walker):
            control, speed = self._actor.get_control(), elementary.hypot(vx, vy)
            control.speed = speed
            if speed > _STANDING:
                control.direction = carla.Vector3D(vx / speed, vy / speed, 0.0)
            self._actor.apply_control(control)
        else:
            there = carla.Location(next_x, next_y, here.location.z)
            self._actor.set_transform(carla.Transform(there, carla.Rotation(yaw=next_yaw)))

    def _step(self, now: float) -> float:
        """Return how long the coming step will be [s]."""
        fixed = CarlaDataProvider.get_world().get_settings().fixed_delta_seconds
        if fixed:
            return float(fixed)
        if self._before is None or now <= self._before:
            return _USUAL_STEP
        return now - self._before

    def _pose(self, time: float) -> tuple[float, float, float]:
        """Return x, y [m] and yaw [deg], in CARLA's frame, at a time [s] since the start."""
        i = bisect.bisect_right(self._times, time)
        if i == 0 or i == len(self._times):
            waypoint = self._waypoints[min(i, len(self._times) - 1)]
            return waypoint.location.x, waypoint.location.y, waypoint.rotation.yaw
        a, b = self._waypoints[i - 1], self._waypoints[i]
        share = (time - self._times[i - 1]) / (self._times[i] - self._times[i - 1])
        return (
            a.location.x + share * (b.location.x - a.location.x),
            a.location.y + share * (b.location.y - a.location.y),
            a.rotation.yaw + share * _turn(b.rotation.yaw - a.rotation.yaw),
        )


def _turn(degrees: float) -> float:
    """Return the shortest equivalent turn [deg]."""
    return (degrees + 180.0) % 360.0 - 180.0
