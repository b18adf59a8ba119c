"""One synthetic traffic, written in each format as its specification says, not as our readers do.

Three participants on a road along x for 4 s at 10 Hz: a car at constant speed, a car that brakes,
a truck that changes lane. `table` is the truth; a writer may leave out what its format lacks.
"""

import json
import math
import pickle
import sqlite3
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

STEP = 0.1
N = 41
SIZES = ((4.6, 1.9), (4.6, 1.9), (10.0, 2.5))  # the usual boxes, for formats that have none
NAMES = ("1", "2", "7")
CLASSES = ("car", "car", "truck")
FOOT = 0.3048


def states(p):
    """Return time, x, y, heading, vx, vy and acceleration of participant p, ``(N,)`` each."""
    t = STEP * np.arange(N) + (0.0, 0.0, 0.5)[p]
    if p == 0:
        x, y, vx, vy, a = 5.0 + 20.0 * t, -4.0 + 0 * t, 20.0 + 0 * t, 0 * t, 0 * t
    elif p == 1:
        x, vx = 40.0 + 18.0 * t - 1.0 * t * t, 18.0 - 2.0 * t
        y, vy, a = -8.0 + 0 * t, 0 * t, -2.0 + 0 * t
    else:
        x, vx = 22.0 * t, 22.0 + 0 * t
        y, vy = -6.0 + 1.75 * np.tanh(t - 2.5), 1.75 / np.cosh(t - 2.5) ** 2
        ay = -2.0 * vy * np.tanh(t - 2.5)
        a = ay * vy / np.hypot(vx, vy)
    return t, x, y, np.arctan2(vy, vx), vx, vy, a


def by_time():
    """Yield (step, p, state) in the order of time, as most recordings have it."""
    tracks = [np.column_stack(states(p)) for p in range(3)]
    rows = [(round(row[0] / STEP), p, row) for p, track in enumerate(tracks) for row in track]
    yield from sorted(rows, key=lambda one: one[:2])


def write_states(folder: Path) -> Path:
    lines = ["time,entity,x,y,h,speed,acceleration,length,width,centre"]
    for _, p, (t, x, y, h, vx, vy, a) in by_time():
        v, ahead = math.hypot(vx, vy), 1.4  # positions are those of a point behind the centre
        at = (x - ahead * math.cos(h), y - ahead * math.sin(h))
        row = (t, NAMES[p], *at, h, v, a, *SIZES[p], ahead)
        lines.append(",".join(map(str, row)))
    return _text(folder / "table.csv", lines)


def write_highd(folder: Path) -> Path:
    lines = ["frame,id,x,y,width,height,xVelocity,yVelocity,xAcceleration,yAcceleration,dhw,laneId"]
    for step, p, (_, x, y, h, vx, vy, a) in sorted(by_time(), key=lambda one: one[1]):
        length, width = SIZES[p]
        ax, ay = a * math.cos(h), -a * math.sin(h)
        lines.append(f"{step},{NAMES[p]},{x - length / 2},{-y - width / 2},{length},{width},"
                     f"{vx},{-vy},{ax},{ay},0.00,{p + 2}")  # fmt: skip
    meta = ["id,width,height,initialFrame,class,drivingDirection"] + [
        f"{name},{size[0]},{size[1]},1,{kind.title()},2"
        for name, size, kind in zip(NAMES, SIZES, CLASSES, strict=True)
    ]
    _text(folder / "01_tracksMeta.csv", meta)
    _text(folder / "01_recordingMeta.csv", ["id,frameRate,locationId", "1,10,2"])
    return _text(folder / "01_tracks.csv", lines)


def write_ind(folder: Path) -> Path:
    lines = ["recordingId,trackId,frame,trackLifetime,xCenter,yCenter,heading,width,length,"
             "xVelocity,yVelocity,xAcceleration,yAcceleration,lonVelocity"]  # fmt: skip
    for step, p, (_, x, y, h, vx, vy, a) in sorted(by_time(), key=lambda one: one[1]):
        length, width = SIZES[p]
        degrees = math.degrees(h) % 360.0
        lines.append(f"7,{NAMES[p]},{step},0,{x},{y},{degrees},{width},{length},{vx},{vy},"
                     f"{a * math.cos(h)},{a * math.sin(h)},0")  # fmt: skip
    meta = ["recordingId,trackId,initialFrame,width,length,class"] + [
        f"7,{name},0,{size[1]},{size[0]},{kind}"
        for name, size, kind in zip(NAMES, SIZES, CLASSES, strict=True)
    ]
    _text(folder / "07_tracksMeta.csv", meta)
    _text(folder / "07_recordingMeta.csv", ["recordingId,locationId,frameRate", "7,1,10.0"])
    return _text(folder / "07_tracks.csv", lines)


def _ngsim_rows():
    for step, p, (t, x, y, h, vx, vy, a) in by_time():
        length, width = SIZES[p]
        front = (x + length / 2 * math.cos(h), y + length / 2 * math.sin(h))
        yield (
            NAMES[p], step, N, 1_113_433_135_300 + round(1000 * t), -front[1] / FOOT,
            front[0] / FOOT, 6e6, 2e6, length / FOOT, width / FOOT,
            {"car": 2, "truck": 3}[CLASSES[p]], math.hypot(vx, vy) / FOOT, a / FOOT, p + 2, 0, 0, 0,
            0,
        )  # fmt: skip


def write_ngsim(folder: Path) -> Path:
    head = (
        "Vehicle_ID,Frame_ID,Total_Frames,Global_Time,Local_X,Local_Y,Global_X,Global_Y,v_length,"
        "v_Width,v_Class,v_Vel,v_Acc,Lane_ID,Preceding,Following,Space_Headway,Time_Headway,"
        "Location"
    )
    rows = [",".join(map(str, row)) + ",us-101" for row in _ngsim_rows()]
    return _text(folder / "ngsim.csv", [head, *rows])


def write_ngsim_text(folder: Path) -> Path:
    rows = ["   ".join(map(str, row)) for row in _ngsim_rows()]
    return _text(folder / "trajectories-0400-0415.txt", rows)


def write_smarts(folder: Path) -> Path:
    path = folder / "history.shf"
    with sqlite3.connect(path) as base:
        base.execute("CREATE TABLE Spec (key TEXT PRIMARY KEY, value TEXT)")
        base.execute("CREATE TABLE Vehicle (id INTEGER PRIMARY KEY, type INTEGER, length REAL,"
                     " width REAL, height REAL, is_ego_vehicle INTEGER)")  # fmt: skip
        base.execute("CREATE TABLE Trajectory (vehicle_id INTEGER, sim_time REAL,"
                     " position_x REAL, position_y REAL, heading_rad REAL, speed REAL,"
                     " lane_id INTEGER)")  # fmt: skip
        for name, size, kind in zip(NAMES, SIZES, CLASSES, strict=True):
            code = {"car": 2, "truck": 3}[kind]
            base.execute("INSERT INTO Vehicle VALUES (?, ?, ?, ?, NULL, 0)", (name, code, *size))
        for _, p, (t, x, y, h, vx, vy, _) in by_time():
            row = (NAMES[p], t, x, y, (h - math.pi / 2) % (2 * math.pi), math.hypot(vx, vy), p + 2)
            base.execute("INSERT INTO Trajectory VALUES (?, ?, ?, ?, ?, ?, ?)", row)
    base.close()
    return path


def write_commonroad(folder: Path) -> Path:
    lines = ['<?xml version="1.0"?>',
             '<commonRoad commonRoadVersion="2020a" benchmarkID="DEU_Test-1_1_T-1" '
             'timeStepSize="0.1">']  # fmt: skip
    for p in range(3):
        lines.append(f'<dynamicObstacle id="{NAMES[p]}"><type>{CLASSES[p]}</type><shape><rectangle>'
                     f"<length>{SIZES[p][0]}</length><width>{SIZES[p][1]}</width>"
                     "</rectangle></shape>")  # fmt: skip
        for k, (t, x, y, h, vx, vy, a) in enumerate(np.column_stack(states(p)).tolist()):
            tag = "state" if k else "initialState"
            lines.append(
                ("<trajectory>" if k == 1 else "")
                + f"<{tag}><position><point><x>{x}</x><y>{y}</y></point></position>"
                f"<orientation><exact>{h}</exact></orientation>"
                f"<time><exact>{round(t / STEP)}</exact></time>"
                f"<velocity><intervalStart>{math.hypot(vx, vy) - 0.1}</intervalStart>"
                f"<intervalEnd>{math.hypot(vx, vy) + 0.1}</intervalEnd></velocity>"
                f"<acceleration><exact>{a}</exact></acceleration></{tag}>"
            )
        lines.append("</trajectory></dynamicObstacle>")
    return _text(folder / "scenario.xml", [*lines, "</commonRoad>"])


def write_interaction(folder: Path) -> Path:
    lines = ["track_id,frame_id,timestamp_ms,agent_type,x,y,vx,vy,psi_rad,length,width"]
    for step, p, (t, x, y, h, vx, vy, _) in sorted(by_time(), key=lambda one: one[1]):
        row = (NAMES[p], step, round(1000 * t), CLASSES[p], x, y, vx, vy, h, *SIZES[p])
        lines.append(",".join(map(str, row)))
    return _text(folder / "vehicle_tracks_000.csv", lines)


def write_sumo(folder: Path) -> Path:
    lines, last = ['<?xml version="1.0" encoding="UTF-8"?>', "<fcd-export>"], None
    for step, p, (t, x, y, h, vx, vy, a) in by_time():
        if step != last:
            lines.append(f'{"</timestep>" if last is not None else ""}<timestep time="{t:.2f}">')
            last = step
        front = (x + SIZES[p][0] / 2 * math.cos(h), y + SIZES[p][0] / 2 * math.sin(h))
        angle = (90.0 - math.degrees(h)) % 360.0
        lines.append(
            f'<vehicle id={quoteattr(NAMES[p])} x="{front[0]}" y="{front[1]}" angle="{angle}" '
            f'type="DEFAULT_{CLASSES[p].upper()}TYPE" speed="{math.hypot(vx, vy)}" pos="0" '
            f'lane="E0_{p}" slope="0" acceleration="{a}"/>'
        )
    return _text(folder / "fcd.xml", [*lines, "</timestep>", "</fcd-export>"])


def write_womd(folder: Path) -> Path:
    objects = []
    for p in range(3):
        one = {"id": int(NAMES[p]), "type": "vehicle", "length": SIZES[p][0], "width": SIZES[p][1],
               "position": [], "heading": [], "velocity": [], "valid": []}  # fmt: skip
        at = {round(t / STEP): row for t, *row in np.column_stack(states(p)).tolist()}
        for step in range(N + 5):
            x, y, h, vx, vy, _ = at.get(step, (-10000.0, -10000.0, 0.0, 0.0, 0.0, 0.0))
            one["position"].append({"x": x, "y": y, "z": 0.0})
            one["heading"].append(h)
            one["velocity"].append({"x": vx, "y": vy})
            one["valid"].append(step in at)
        objects.append(one)
    path = folder / "tfrecord-00000_1.json"
    path.write_text(json.dumps({"name": "one", "objects": objects, "roads": [], "tl_states": {}}))
    return path


def write_argoverse(folder: Path) -> Path:
    import pyarrow as pa
    import pyarrow.parquet as pq

    rows = [
        {"track_id": NAMES[p], "object_type": "vehicle", "timestep": step, "position_x": x,
         "position_y": y, "heading": h, "velocity_x": vx, "velocity_y": vy,
         "scenario_id": "0a1e", "city": "austin"}
        for step, p, (_, x, y, h, vx, vy, _) in by_time()
    ]  # fmt: skip
    pq.write_table(pa.Table.from_pylist(rows), folder / "scenario_0a1e.parquet")
    return folder / "scenario_0a1e.parquet"


def write_scenarionet(folder: Path) -> Path:
    tracks = {}
    for p in range(3):
        at = {round(row[0] / STEP): row for row in np.column_stack(states(p))}
        valid = np.array([step in at for step in range(N + 5)])
        rows = np.array([at.get(step, np.zeros(7)) for step in range(N + 5)])
        tracks[NAMES[p]] = {"type": "VEHICLE", "metadata": {}, "state": {
            "position": np.column_stack([rows[:, 1:3], np.zeros(N + 5)]),
            "heading": rows[:, 3], "velocity": rows[:, 4:6], "valid": valid,
            "length": np.full((N + 5, 1), SIZES[p][0]), "width": np.full(N + 5, SIZES[p][1]),
        }}  # fmt: skip
    whole = {"id": "one", "version": "x", "length": N + 5, "tracks": tracks, "map_features": {},
             "dynamic_map_states": {}, "metadata": {"ts": STEP * np.arange(N + 5)}}  # fmt: skip
    path = folder / "sd_one.pkl"
    path.write_bytes(pickle.dumps(whole))
    return path


def _text(path: Path, lines: list[str]) -> Path:
    path.write_text("\n".join(lines) + "\n")
    return path
