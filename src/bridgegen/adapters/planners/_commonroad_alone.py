"""CommonRoad's reactive planner on arrays, with its own packages alone: the script that reproduces.

`bridgegen.adapters.planners.commonroad_reactive.reproduction` returns this file with a few lines
that call it, so it imports nothing of BridgeGen, and the planner's packages only when it is called.

A road is a dictionary of arrays: ``lane_points`` (L,), how many points each lane has;
``lane_centre``, ``lane_left``, ``lane_right`` (their sum, 2) [m]; ``lane_beside`` (L, 4), the
lanes on the left and right (their index, or -1) and whether they go the same way; ``lane_next``
(K, 2), pairs of lanes of which the second continues the first; ``reference`` (R, 2) [m], the path
to follow.
"""

import logging
import math
import warnings
from typing import Any

import numpy as np
import numpy.typing as npt

Arrays = dict[str, npt.NDArray[Any]]
Float = npt.NDArray[np.float64]

STEP = 0.1  # s
N_STEPS = 20  # the horizon of the authors' configurations, in steps
FRONT_AXLE = 1.1561957064  # m ahead of the body's centre, the package's default vehicle
GREATEST_ACCELERATION = 11.5  # m/s², of the same


class Reactive:
    """The planner on one road.

    Args:
        road: see the module.
        body: length, width, centre ahead of the rear axle [m], greatest acceleration [m/s²] and
            curvature [1/m].
    """

    def __init__(self, road: Arrays, body: Float) -> None:
        from commonroad.scenario.scenario import Scenario, ScenarioID
        from commonroad_dc.boundary.boundary import create_road_boundary_obstacle
        from commonroad_rp.reactive_planner import ReactivePlanner
        from commonroad_rp.utility.config import ReactivePlannerConfiguration
        from commonroad_rp.utility.utils_coordinate_system import create_coordinate_system

        scenario = Scenario(STEP, ScenarioID())
        scenario.add_objects(network(road))
        config = ReactivePlannerConfiguration()
        config.planning.dt, config.planning.time_steps_computation = STEP, N_STEPS
        config.debug.multiproc, config.debug.logging_level = False, "ERROR"
        vehicle = config.vehicle
        vehicle.length, vehicle.width, vehicle.wb_rear_axle = (float(item) for item in body[:3])
        vehicle.wb_front_axle = FRONT_AXLE
        vehicle.wheelbase = vehicle.wb_front_axle + vehicle.wb_rear_axle
        vehicle.a_max = min(GREATEST_ACCELERATION, float(body[3]))
        vehicle.kappa_max = float(body[4])
        vehicle.delta_max = math.atan(vehicle.kappa_max * vehicle.wheelbase)
        vehicle.delta_min = -vehicle.delta_max
        config.update(scenario=scenario)
        logging.getLogger("RP_LOGGER").setLevel("ERROR")
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # it divides by a straight road's curvature
            self._planner = ReactivePlanner(config)
            self._coordinates = create_coordinate_system(road["reference"])
        self._planner.set_reference_path(coordinate_system=self._coordinates)
        _, self._boundary = create_road_boundary_obstacle(scenario)
        self._vehicle = vehicle

    def plan(self, state: Float, target_speed: float, others: Float) -> Float | None:
        """Return its plan, ``(N_STEPS + 1, 6)``, one state for each `STEP`; None if it has none.

        Args:
            state: x, y [m] of the rear axle's centre, heading [rad], speed [m/s], acceleration
                [m/s²], curvature [1/m]; and so the states of the plan.
            target_speed: [m/s].
            others: ``(M, N_STEPS + 1, 5)``, where they will be: x, y [m] of the centre, heading
                [rad], length, width [m]; NaN where there is none.
        """
        from commonroad_rp.state import ReactivePlannerState

        x, y, h, v, a, curvature = (float(item) for item in state)
        planner, limit = self._planner, self._vehicle.a_max
        start = ReactivePlannerState(
            time_step=0,
            position=np.array([x, y]),
            steering_angle=math.atan(curvature * self._vehicle.wheelbase),
            velocity=v,
            orientation=h,
            acceleration=min(max(a, -limit), limit),
            yaw_rate=v * curvature,
        )
        # Its reset converts the state by the mode of its last plan, which was another scenario's.
        planner._low_vel_mode = v < planner.config.planning.low_vel_mode_threshold
        try:
            with np.errstate(all="ignore"):
                planner.reset(
                    initial_state_cart=start,
                    collision_checker=self._checker(others),
                    coordinate_system=self._coordinates,
                )
                # At exactly 0 it would ask a planning problem, which there is none, for the speed.
                planner.set_desired_velocity(target_speed, current_speed=max(v, 1e-6))
                found = planner.plan()
        except Exception:  # off its reference path, or against it, it raises, some of them bare
            return None
        if found is None:
            return None
        plan = np.array(
            [
                (
                    *item.position,
                    item.orientation,
                    item.velocity,
                    item.acceleration,
                    math.tan(item.steering_angle) / self._vehicle.wheelbase,
                )
                for item in found[0].state_list
            ]
        )
        lacking = N_STEPS + 1 - len(plan)  # the one at standstill is shorter
        return np.concatenate([plan, np.repeat(plan[-1:], lacking, axis=0)])

    def _checker(self, others: Float) -> Any:
        import commonroad_dc.pycrcc as pycrcc

        checker = pycrcc.CollisionChecker()
        checker.add_collision_object(self._boundary)
        for other in others[np.isfinite(others).all(axis=(1, 2))]:
            moving = pycrcc.TimeVariantCollisionObject(0)
            for x, y, h, length, width in other.tolist():
                moving.append_obstacle(pycrcc.RectOBB(length / 2, width / 2, h, x, y))
            checker.add_collision_object(moving)
        return checker


def network(road: Arrays) -> Any:
    """Return the road as a CommonRoad network of lanelets, numbered from 1."""
    from commonroad.scenario.lanelet import Lanelet, LaneletNetwork

    ends = np.cumsum(road["lane_points"])
    lanelets = []
    for k, (end, n) in enumerate(zip(ends, road["lane_points"], strict=True)):
        points = slice(end - n, end)
        left, right, left_same, right_same = road["lane_beside"][k].tolist()
        follows = road["lane_next"]
        lanelets.append(
            Lanelet(
                left_vertices=road["lane_left"][points],
                center_vertices=road["lane_centre"][points],
                right_vertices=road["lane_right"][points],
                lanelet_id=k + 1,
                predecessor=(follows[follows[:, 1] == k, 0] + 1).tolist(),
                successor=(follows[follows[:, 0] == k, 1] + 1).tolist(),
                adjacent_left=left + 1 if left >= 0 else None,
                adjacent_left_same_direction=bool(left_same) if left >= 0 else None,
                adjacent_right=right + 1 if right >= 0 else None,
                adjacent_right_same_direction=bool(right_same) if right >= 0 else None,
            )
        )
    return LaneletNetwork.create_from_lanelet_list(lanelets)
