"""The script that runs FISS+ alone on exported inputs."""

SCRIPT = '''"""FISS+ on what it was told, without BridgeGen: pip install 'fiss-planner>=1.0,<2'.

It prints the acceleration [m/s²] and the steering angle's curvature [1/m] of each instant.
"""

import math

import fiss_planner as fp
import numpy as np

told = np.load({path!r}, allow_pickle=False)
points = [np.split(told[k], np.cumsum(told["lanes"][:, 5].astype(int))[:-1])
          for k in ("centre", "left", "right")]
road = fp.RoadMap()
for i, (limit, left, to_left, right, to_right, _) in enumerate(told["lanes"].tolist()):
    lane = fp.MapLane()
    lane.id, lane.speed_limit = i + 1, limit
    lane.centerline, lane.left, lane.right = (np.ascontiguousarray(part[i]) for part in points)
    if left >= 0:
        lane.left_neighbor, lane.can_change_left = int(left) + 1, bool(to_left)
    if right >= 0:
        lane.right_neighbor, lane.can_change_right = int(right) + 1, bool(to_right)
    lane.successors = [int(b) + 1 for a, b in told["next"] if a == i]
    lane.predecessors = [int(a) + 1 for a, b in told["next"] if b == i]
    road.add_lane(lane)
for i, (lane, station, _) in enumerate(told["stop_lines"].tolist()):
    road.add_stop_line(fp.StopLine(i, int(lane) + 1, station, False))
road.finalize()

vehicle = fp.VehicleParams()
for name, value in zip(
    ("length", "width", "wheelbase", "rear_axle_to_center", "max_speed", "max_accel", "max_decel",
     "max_steer", "max_lat_accel"), told["vehicle"].tolist(),
):
    setattr(vehicle, name, value)
config = fp.LocalPlannerConfig()
config.planner.type = fp.PlannerType.FISS_PLUS
config.planner.collision.ignore_rear_in_lane = True
planner = fp.LocalPlanner(config, vehicle)
planner.set_map(road, [int(one) + 1 for one in told["route"]])
controller = fp.make_controller("mpc", vehicle)

horizon, plan = config.planner.sampling.max_t + 0.5, None
for k, t in enumerate(told["time"].tolist()):
    ego = fp.EgoState(*told["ego"][k].tolist())
    if k % 2 == 0:
        for line, active in enumerate(told["active"][k].tolist()):
            planner.set_stop_line_active(line, active)
        obstacles = []
        for i, (there, is_vehicle, *state) in enumerate(told["obstacles"][k].tolist()):
            if there and is_vehicle:
                obstacles.append(fp.predict_lane_following(road, i, *state, horizon, 0.1))
            elif there:
                obstacles.append(fp.predict_constant_velocity(i, *state, horizon, 0.1))
        out = planner.step(t, ego, obstacles, float(told["desired"][k]))
        if len(out.trajectory) >= 2:
            plan, planned_at = out.trajectory, t
    if plan is None:
        print(0.0, 0.0)
        continue
    command = controller.compute(ego, plan, t - planned_at)
    print(repr(command.accel), repr(math.tan(command.steer) / vehicle.wheelbase))
'''
