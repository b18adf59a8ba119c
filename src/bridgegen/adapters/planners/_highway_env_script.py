"""The script that repeats a row with highway-env alone, for `highway_env`."""

SCRIPT = '''"""Prints what highway-env 1.12.1's IDMVehicle commands, by highway-env alone.

pip install highway-env==1.12.1
One line for each instant: acceleration [m/s2], steering angle [rad].
"""

import numpy as np
from highway_env.road.lane import CircularLane, PolyLaneFixedWidth, StraightLane
from highway_env.road.road import Road, RoadNetwork
from highway_env.vehicle.behavior import IDMVehicle
from highway_env.vehicle.controller import ControlledVehicle
from highway_env.vehicle.objects import Obstacle

data = dict(np.load(OBSERVATIONS))

network, lanes = RoadNetwork(), []
for i, edge in enumerate(data["lane_edge"]):
    points, width = data["points"][data["points_of"] == i], float(data["lane_width"][i])
    if data["lane_kind"][i] == 0:
        lane = StraightLane(points[0], points[1], width)
    elif data["lane_kind"][i] == 1:
        x, y, radius, first, last, grows = data["lane_arc"][i]
        lane = CircularLane([x, y], radius, first, last, bool(grows), width)
    else:
        lane = PolyLaneFixedWidth(points, width)
    network.add_lane(str(edge), str(edge + 1), lane)
    lanes.append(lane)
road = Road(network, neighbour_vehicles_connected_lanes=True)
for lane, ends in zip(lanes, data["lane_ends"]):
    if ends:
        road.objects.append(Obstacle(road, lane.position(lane.length, 0)))


def place(vehicle, state):
    vehicle.position, vehicle.heading, vehicle.speed = state[:2], state[2], state[3]
    vehicle.on_state_update()


ego, others = None, {}
for t, state in enumerate(data["ego"]):
    for lane, limit, forbidden in zip(lanes, data["speed_limit"][t], data["forbidden"][t]):
        lane.speed_limit, lane.forbidden = (limit if np.isfinite(limit) else None), forbidden
    if ego is None:
        ego = IDMVehicle(road, state[:2], state[2], state[3])
    road.vehicles = [ego]
    for j, (there, *of) in enumerate(data["others"][t]):
        if there:
            if j not in others:
                others[j] = ControlledVehicle(road, of[:2], of[2], of[3])
            place(others[j], np.array(of))
            others[j].target_speed = of[3]
            others[j].target_lane_index = others[j].lane_index
            road.vehicles.append(others[j])
    place(ego, state)
    ego.target_speed = state[4]
    ego.act()
    ego.timer += float(data["time_step"])
    print(repr(float(ego.action["acceleration"])), repr(float(ego.action["steering"])))
'''
