"""Traffic, written in each format as its specification says, not as our readers do.

That of the tests: three participants on a road along x for 4 s at 10 Hz: a car at constant speed, a
car that brakes, a truck that changes lane. `states` is the truth; a writer may leave out what its
format lacks.
"""

import json
import math
import pickle
import sqlite3
from pathlib import Path
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

import numpy as np

from bridgegen.drivers.kinds import TRUCK
from bridgegen.recordings.readers.states import centre_ahead

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
    else:  # the rear axle's path is given, and its wheels roll along it
        vy, bend = 1.75 / np.cosh(t - 2.5) ** 2, -3.5 * np.tanh(t - 2.5) / np.cosh(t - 2.5) ** 2
        h = np.arctan2(vy, 22.0)
        turning, ahead = np.cos(h) ** 2 * bend / 22.0, centre_ahead(TRUCK, SIZES[p][0])
        x = 22.0 * t + ahead * np.cos(h)
        y = -6.0 + 1.75 * np.tanh(t - 2.5) + ahead * np.sin(h)
        vx, vy = 22.0 - ahead * turning * np.sin(h), vy + ahead * turning * np.cos(h)
        return t, x, y, h, vx, vy, bend * np.sin(h) - ahead * turning**2
    return t, x, y, np.arctan2(vy, vx), vx, vy, a


class Track(NamedTuple):
    """A participant: its name is a number, and so is its lane.

    ``states`` is ``(N, 7)``: time, of the centre x, y, heading, vx and vy, and the acceleration.
    """

    name: str
    kind: str
    length: float
    width: float
    states: np.ndarray
    lane: int = 0


TRACKS = tuple(
    Track(NAMES[p], CLASSES[p], *SIZES[p], np.column_stack(states(p)), p + 2) for p in range(3)
)


def by_time(tracks, step):
    """Yield (frame, track, state) in the order of time, as most recordings have it."""
    rows = [
        (round(row[0] / step), k, row)
        for k, track in enumerate(tracks) for row in track.states.tolist()
    ]  # fmt: skip
    yield from ((frame, tracks[k], row) for frame, k, row in sorted(rows, key=lambda one: one[:2]))


def by_track(tracks, step):
    """Yield (frame, track, state), one track after the other."""
    for track in tracks:
        for row in track.states.tolist():
            yield round(row[0] / step), track, row


def write_states(folder: Path, tracks=TRACKS, step=STEP) -> Path:
    lines = ["time,entity,x,y,h,speed,acceleration,length,width,centre"]
    for _, one, (t, x, y, h, vx, vy, a) in by_time(tracks, step):
        v, ahead = math.hypot(vx, vy), 1.4  # positions are those of a point behind the centre
        at = (x - ahead * math.cos(h), y - ahead * math.sin(h))
        row = (t, one.name, *at, h, v, a, one.length, one.width, ahead)
        lines.append(",".join(map(str, row)))
    return _text(folder / "table.csv", lines)


def write_highd(folder: Path, tracks=TRACKS, step=STEP) -> Path:
    lines = ["frame,id,x,y,width,height,xVelocity,yVelocity,xAcceleration,yAcceleration,dhw,laneId"]
    for frame, one, (_, x, y, h, vx, vy, a) in by_track(tracks, step):
        ax, ay = a * math.cos(h), -a * math.sin(h)
        lines.append(f"{frame},{one.name},{x - one.length / 2},{-y - one.width / 2},{one.length},"
                     f"{one.width},{vx},{-vy},{ax},{ay},0.00,{one.lane}")  # fmt: skip
    meta = ["id,width,height,initialFrame,class,drivingDirection"] + [
        f"{one.name},{one.length},{one.width},1,{one.kind.title()},2" for one in tracks
    ]
    _text(folder / "01_tracksMeta.csv", meta)
    _text(folder / "01_recordingMeta.csv", ["id,frameRate,locationId", f"1,{1 / step:g},2"])
    return _text(folder / "01_tracks.csv", lines)


def write_ind(folder: Path, tracks=TRACKS, step=STEP) -> Path:
    lines = ["recordingId,trackId,frame,trackLifetime,xCenter,yCenter,heading,width,length,"
             "xVelocity,yVelocity,xAcceleration,yAcceleration,lonVelocity"]  # fmt: skip
    for frame, one, (_, x, y, h, vx, vy, a) in by_track(tracks, step):
        degrees = math.degrees(h) % 360.0
        lines.append(f"7,{one.name},{frame},0,{x},{y},{degrees},{one.width},{one.length},{vx},{vy},"
                     f"{a * math.cos(h)},{a * math.sin(h)},0")  # fmt: skip
    meta = ["recordingId,trackId,initialFrame,width,length,class"] + [
        f"7,{one.name},0,{one.width},{one.length},{one.kind}" for one in tracks
    ]
    _text(folder / "07_tracksMeta.csv", meta)
    _text(folder / "07_recordingMeta.csv",
          ["recordingId,locationId,frameRate", f"7,1,{1 / step:g}"])  # fmt: skip
    return _text(folder / "07_tracks.csv", lines)


def _ngsim_rows(tracks, step):
    for frame, one, (t, x, y, h, vx, vy, a) in by_time(tracks, step):
        front = (x + one.length / 2 * math.cos(h), y + one.length / 2 * math.sin(h))
        yield (
            one.name, frame, len(one.states), 1_113_433_135_300 + round(1000 * t), -front[1] / FOOT,
            front[0] / FOOT, 6e6, 2e6, one.length / FOOT, one.width / FOOT,
            {"car": 2, "truck": 3}[one.kind], math.hypot(vx, vy) / FOOT, a / FOOT, one.lane, 0, 0,
            0, 0,
        )  # fmt: skip


def write_ngsim(folder: Path, tracks=TRACKS, step=STEP) -> Path:
    head = (
        "Vehicle_ID,Frame_ID,Total_Frames,Global_Time,Local_X,Local_Y,Global_X,Global_Y,v_length,"
        "v_Width,v_Class,v_Vel,v_Acc,Lane_ID,Preceding,Following,Space_Headway,Time_Headway,"
        "Location"
    )
    rows = [",".join(map(str, row)) + ",us-101" for row in _ngsim_rows(tracks, step)]
    return _text(folder / "ngsim.csv", [head, *rows])


def write_ngsim_text(folder: Path, tracks=TRACKS, step=STEP) -> Path:
    rows = ["   ".join(map(str, row)) for row in _ngsim_rows(tracks, step)]
    return _text(folder / "trajectories-0400-0415.txt", rows)


def write_smarts(folder: Path, tracks=TRACKS, step=STEP) -> Path:
    path = folder / "history.shf"
    codes = {"car": 2, "truck": 3, "pedestrian": 4}
    with sqlite3.connect(path) as base:
        base.execute("CREATE TABLE Spec (key TEXT PRIMARY KEY, value TEXT)")
        base.execute("CREATE TABLE Vehicle (id INTEGER PRIMARY KEY, type INTEGER, length REAL,"
                     " width REAL, height REAL, is_ego_vehicle INTEGER)")  # fmt: skip
        base.execute("CREATE TABLE Trajectory (vehicle_id INTEGER, sim_time REAL,"
                     " position_x REAL, position_y REAL, heading_rad REAL, speed REAL,"
                     " lane_id INTEGER)")  # fmt: skip
        base.executemany("INSERT INTO Vehicle VALUES (?, ?, ?, ?, NULL, 0)",
                         ((one.name, codes[one.kind], one.length, one.width)
                          for one in tracks))  # fmt: skip
        rows = (
            (one.name, t, x, y, (h - math.pi / 2) % (2 * math.pi), math.hypot(vx, vy), one.lane)
            for _, one, (t, x, y, h, vx, vy, _) in by_time(tracks, step)
        )
        base.executemany("INSERT INTO Trajectory VALUES (?, ?, ?, ?, ?, ?, ?)", rows)
    base.close()
    return path


def write_commonroad(folder: Path, tracks=TRACKS, step=STEP) -> Path:
    lines = ['<?xml version="1.0"?>',
             '<commonRoad commonRoadVersion="2020a" benchmarkID="DEU_Test-1_1_T-1" '
             f'timeStepSize="{step}">']  # fmt: skip
    for one in tracks:
        lines.append(f'<dynamicObstacle id="{one.name}"><type>{one.kind}</type><shape><rectangle>'
                     f"<length>{one.length}</length><width>{one.width}</width>"
                     "</rectangle></shape>")  # fmt: skip
        for k, (t, x, y, h, vx, vy, a) in enumerate(one.states.tolist()):
            tag = "state" if k else "initialState"
            lines.append(
                ("<trajectory>" if k == 1 else "")
                + f"<{tag}><position><point><x>{x}</x><y>{y}</y></point></position>"
                f"<orientation><exact>{h}</exact></orientation>"
                f"<time><exact>{round(t / step)}</exact></time>"
                f"<velocity><intervalStart>{math.hypot(vx, vy) - 0.1}</intervalStart>"
                f"<intervalEnd>{math.hypot(vx, vy) + 0.1}</intervalEnd></velocity>"
                f"<acceleration><exact>{a}</exact></acceleration></{tag}>"
            )
        lines.append("</trajectory></dynamicObstacle>")
    return _text(folder / "scenario.xml", [*lines, "</commonRoad>"])


def write_interaction(folder: Path, tracks=TRACKS, step=STEP) -> Path:
    lines = ["track_id,frame_id,timestamp_ms,agent_type,x,y,vx,vy,psi_rad,length,width"]
    for frame, one, (t, x, y, h, vx, vy, _) in by_track(tracks, step):
        row = (one.name, frame, round(1000 * t), one.kind, x, y, vx, vy, h, one.length, one.width)
        lines.append(",".join(map(str, row)))
    return _text(folder / "vehicle_tracks_000.csv", lines)


def write_sumo(folder: Path, tracks=TRACKS, step=STEP) -> Path:
    lines, last = ['<?xml version="1.0" encoding="UTF-8"?>', "<fcd-export>"], None
    for frame, one, (t, x, y, h, vx, vy, a) in by_time(tracks, step):
        if frame != last:
            lines.append(f'{"</timestep>" if last is not None else ""}<timestep time="{t:.2f}">')
            last = frame
        front = (x + one.length / 2 * math.cos(h), y + one.length / 2 * math.sin(h))
        angle = (90.0 - math.degrees(h)) % 360.0
        tag = "person" if one.kind == "pedestrian" else "vehicle"
        lines.append(
            f'<{tag} id={quoteattr(one.name)} x="{front[0]}" y="{front[1]}" angle="{angle}" '
            f'type="DEFAULT_{one.kind.upper()}TYPE" speed="{math.hypot(vx, vy)}" pos="0" '
            f'lane="E0_{one.lane}" slope="0" acceleration="{a}"/>'
        )
    return _text(folder / "fcd.xml", [*lines, "</timestep>", "</fcd-export>"])


def _dense(tracks, step):
    """Return per track its states by frame, and how many frames there are."""
    frames = [
        {round(row[0] / step): row[1:] for row in track.states.tolist()} for track in tracks
    ]  # fmt: skip
    return frames, max(max(one) for one in frames) + 1


def write_womd(folder: Path, tracks=TRACKS, step=STEP) -> Path:
    objects, (frames, count) = [], _dense(tracks, step)
    for track, at in zip(tracks, frames, strict=True):
        kind = {"pedestrian": "pedestrian", "bicycle": "cyclist"}.get(track.kind, "vehicle")
        one = {"id": int(track.name), "type": kind, "length": track.length, "width": track.width,
               "position": [], "heading": [], "velocity": [], "valid": []}  # fmt: skip
        for frame in range(count):
            x, y, h, vx, vy, _ = at.get(frame, (-10000.0, -10000.0, 0.0, 0.0, 0.0, 0.0))
            one["position"].append({"x": x, "y": y, "z": 0.0})
            one["heading"].append(h)
            one["velocity"].append({"x": vx, "y": vy})
            one["valid"].append(frame in at)
        objects.append(one)
    path = folder / "tfrecord-00000_1.json"
    path.write_text(json.dumps({"name": "one", "objects": objects, "roads": [], "tl_states": {}}))
    return path


def write_argoverse(folder: Path, tracks=TRACKS, step=STEP) -> Path:
    import pyarrow as pa
    import pyarrow.parquet as pq

    rows = [
        {"track_id": one.name, "object_type": "vehicle", "timestep": frame, "position_x": x,
         "position_y": y, "heading": h, "velocity_x": vx, "velocity_y": vy,
         "scenario_id": "0a1e", "city": "austin"}
        for frame, one, (_, x, y, h, vx, vy, _) in by_time(tracks, step)
    ]  # fmt: skip
    pq.write_table(pa.Table.from_pylist(rows), folder / "scenario_0a1e.parquet")
    return folder / "scenario_0a1e.parquet"


def write_scenarionet(folder: Path, tracks=TRACKS, step=STEP) -> Path:
    found, (frames, count) = {}, _dense(tracks, step)
    for track, at in zip(tracks, frames, strict=True):
        kind = {"pedestrian": "PEDESTRIAN", "bicycle": "CYCLIST"}.get(track.kind, "VEHICLE")
        rows = np.array([at.get(frame, np.zeros(6)) for frame in range(count)])
        found[track.name] = {"type": kind, "metadata": {}, "state": {
            "position": np.column_stack([rows[:, :2], np.zeros(count)]),
            "heading": rows[:, 2], "velocity": rows[:, 3:5],
            "valid": np.array([frame in at for frame in range(count)]),
            "length": np.full((count, 1), track.length), "width": np.full(count, track.width),
        }}  # fmt: skip
    whole = {"id": "one", "version": "x", "length": count, "tracks": found, "map_features": {},
             "dynamic_map_states": {}, "metadata": {"ts": step * np.arange(count)}}  # fmt: skip
    path = folder / "sd_one.pkl"
    path.write_bytes(pickle.dumps(whole))
    return path


def _text(path: Path, lines: list[str]) -> Path:
    path.write_text("\n".join(lines) + "\n")
    return path
