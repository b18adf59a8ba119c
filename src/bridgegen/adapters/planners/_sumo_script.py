"""The script that repeats a row with libsumo alone, for `bridgegen.adapters.planners.sumo`."""

SCRIPT = '''"""Prints what SUMO 1.28's Krauss, EIDM, ACC or CACC commands, by libsumo alone.

pip install libsumo==1.28.0
python THIS_FILE [Krauss|EIDM|ACC|CACC]
One line for each instant: acceleration [m/s2], lane from the left that LC2013 wants.
"""

import os
import sys
import tempfile

import libsumo
import numpy as np

model = sys.argv[1] if len(sys.argv) > 1 else "Krauss"
data = dict(np.load(OBSERVATIONS))
step, lanes, following = float(data["time_step"]), data["lanes"], data["next"]
vehicle = libsumo.vehicle

with tempfile.TemporaryDirectory() as folder:
    names = {"network": "road.net.xml", "types": "types.add.xml"}
    for key, name in names.items():
        with open(os.path.join(folder, name), "w") as file:
            file.write(str(data[key]))
    libsumo.start(
        ["sumo", "-n", os.path.join(folder, "road.net.xml")]
        + ["-a", os.path.join(folder, "types.add.xml"), "--step-length", f"{step:g}"]
        + ["--collision.action", "none", "--time-to-teleport", "-1"]
        + ["--no-internal-links", "--no-step-log", "--no-warnings"]
    )


def lane_id(edge, lane):
    return f"r0e{int(edge)}_{int(lanes[int(edge)]) - 1 - int(lane)}"


def park(j):
    vehicle.moveTo(f"o{j}", f"r0e{len(lanes) - 1}_0", 10000.0 + 100.0 * j)
    vehicle.setPreviousSpeed(f"o{j}", 0.0)
    vehicle.setSpeed(f"o{j}", 0.0)


libsumo.route.add("route", str(data["route"]).split())
vehicle.add("ego", "route", typeID=model)
away = [True] * data["others"].shape[1]
for j in range(len(away)):
    vehicle.add(f"o{j}", "route", typeID="other")
    park(j)
    vehicle.setSpeedMode(f"o{j}", 0)
    vehicle.setLaneChangeMode(f"o{j}", 0)

goal, goal_edge = 0, -1
for t, (edge, position, speed, acceleration, most, nearest) in enumerate(data["ego"].tolist()):
    edge, nearest = int(edge), int(nearest)
    if goal_edge < 0 or edge < goal_edge:
        goal_edge, goal = edge, nearest
    while goal_edge < edge:
        goal = int(following[goal_edge, goal])
        goal_edge += 1
        if goal < 0:
            goal_edge, goal = edge, nearest
    vehicle.moveTo("ego", lane_id(edge, goal), position)
    vehicle.setMaxSpeed("ego", most)
    vehicle.setPreviousSpeed("ego", speed, acceleration)
    for j, (there, at, p, lane, v, a, length) in enumerate(data["others"][t].tolist()):
        if there:
            vehicle.setLength(f"o{j}", length)
            vehicle.moveTo(f"o{j}", lane_id(at, lane), p)
            vehicle.setPreviousSpeed(f"o{j}", v, a)
            vehicle.setSpeed(f"o{j}", v)
        elif not away[j]:
            park(j)
        away[j] = not there
    libsumo.simulationStep()
    wanted = vehicle.getSpeed("ego")
    wish = goal
    if vehicle.getRoadID("ego") == f"r0e{edge}":
        wish = int(lanes[edge]) - 1 - vehicle.getLaneIndex("ego")
    least = max(speed - 9.0 * step, 0.0)
    for lane, ahead in enumerate(data["ahead"][t].tolist()):
        gap, of, j = ahead[3:] if lane == goal else ahead[:3]
        if gap < np.inf:
            follow = vehicle.getFollowSpeed("ego", speed, gap - 2.5, of, 4.5, f"o{int(j)}")
            wanted = min(wanted, max(follow, least))
    stop = float(data["stop"][t])
    if stop < np.inf:
        wanted = min(wanted, max(vehicle.getStopSpeed("ego", speed, stop), least))
    print(repr((wanted - speed) / step), wish)
    goal = wish
'''
