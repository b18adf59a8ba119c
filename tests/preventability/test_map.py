"""Maps: hand-worked cells, the same bits however they are made, resuming, files, bad input."""

import json
from pathlib import Path

import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen.base.errors import InputError, Interrupted, StorageError, UnknownNameError
from bridgegen.cli import main
from bridgegen.drivers.preventable import avoids_cut_in
from bridgegen.jobs.frame import JobCallbacks
from bridgegen.jobs.preventability import preventability as module
from bridgegen.jobs.preventability import result as chunks
from bridgegen.jobs.preventability.classes import CellClass
from bridgegen.jobs.preventability.grid import GridAxis
from bridgegen.jobs.preventability.preventability import map_preventability

GRID = ["gap=1:61:13", "relative_speed=10 km/h:50 km/h:5", "lateral_speed=0.6:1.8:3"]
HALT = """
import numpy as np
from bridgegen.drivers.interface import Control

class Halts:
    def reset(self, n, scene):
        pass
    def act(self, observation):
        n = len(observation.v)
        return Control(np.full(n, -8.0), np.zeros(n))

class Fails(Halts):
    def act(self, observation):
        if (observation.v > 20.0).any():
            raise RuntimeError("too fast for me")
        return super().act(observation)
"""


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """An undisturbed map of two drivers."""
    out = tmp_path_factory.mktemp("maps") / "whole"
    return map_preventability("r157/cut-in", ["route-follower", "un-r157"], grid=GRID, out=out)


def cell(found, driver: str, **values: float) -> CellClass:
    """The class of the cell that has these values."""
    at = tuple(
        int(np.argmin(np.abs(axis - values[name])))
        for name, axis in zip(found.grid.names, found.grid.values, strict=True)
    )
    for i, (name, axis) in zip(
        at, zip(found.grid.names, found.grid.values, strict=True), strict=True
    ):
        assert axis[i] == pytest.approx(values[name])
    return CellClass(found.classes[driver][at])


def test_hand_worked_cells(whole):
    """At 60 km/h, the other 40 km/h (11.1 m/s) slower, bodies overlap 1.65 m / lateral speed on.

    Gap 46 m, 1.8 m/s: a driver that does not brake is there after 4.1 s; at the overlap, after
    0.92 s, 35.8 m remain, for which 11.1² / (2 · 35.8) = 1.7 m/s² suffice: preventable.
    Gap 6 m, 1.8 m/s: at the overlap the other's rear is 4.2 m behind the ego's front: its flank is
    hit at once, and no braking helps: not preventable.
    Gap 61 m, 10 km/h: 42 m are closed in the 15 s that remain: nobody collides.
    """
    fast = 40.0 / 3.6
    for driver, expected in (
        ("route-follower", CellClass.PREVENTABLE),
        ("un-r157", CellClass.AVOIDED),
    ):
        assert cell(whole, driver, gap=46.0, relative_speed=fast, lateral_speed=1.8) == expected
    for driver in ("route-follower", "un-r157"):
        near = cell(whole, driver, gap=6.0, relative_speed=fast, lateral_speed=1.8)
        far = cell(whole, driver, gap=61.0, relative_speed=10.0 / 3.6, lateral_speed=1.8)
        assert (near, far) == (CellClass.UNPREVENTABLE, CellClass.AVOIDED)


def test_the_models_are_those_of_the_regulation(whole):
    """Where the other turns little; bodies of the regulation do not turn at all."""
    gap, relative, lateral = np.meshgrid(*whole.grid.values, indexing="ij")
    speed = 60.0 / 3.6
    expected = avoids_cut_in(speed, speed - relative, gap, lateral)
    found = whole.classes["un-r157"] == CellClass.AVOIDED
    little = lateral / (speed - relative) < np.tan(np.radians(4.0))
    assert little.sum() >= 26
    assert (found == expected)[little].mean() >= 0.95
    assert (found == expected).mean() >= 0.85


def test_counts_and_shares(whole):
    counts = whole.counts("route-follower")
    assert sum(counts.values()) == whole.grid.cells == 13 * 5 * 3
    figures = whole.figures("route-follower")
    assert figures["preventable"] == (whole.classes["route-follower"] == 1).sum() > 0
    assert figures["preventable_share"] == figures["preventable"] / whole.grid.cells
    summary = json.loads((whole.folder / "summary.json").read_text())
    assert summary["drivers"][0] == figures


def test_the_arrays_are_kept(whole):
    with np.load(whole.folder / "map.npz", allow_pickle=False) as arrays:
        assert arrays["drivers"].tolist() == ["route-follower", "un-r157"]
        np.testing.assert_array_equal(arrays["classes"][1], whole.classes["un-r157"])
        np.testing.assert_array_equal(arrays["axis_gap"], np.linspace(1.0, 61.0, 13))


def test_a_driver_alone_has_the_same_classes(whole, tmp_path):
    alone = map_preventability("r157/cut-in", "route-follower", grid=GRID, out=tmp_path / "one")
    np.testing.assert_array_equal(alone.classes["route-follower"], whole.classes["route-follower"])


@pytest.mark.thorough
@pytest.mark.parametrize(("size", "workers"), [(7, None), (64, 2)])
def test_neither_chunks_nor_workers_change_a_bit(whole, tmp_path, monkeypatch, size, workers):
    monkeypatch.setattr(chunks, "CHUNK", size)
    again = map_preventability(
        "r157/cut-in", whole.drivers, grid=GRID, workers=workers, out=tmp_path / "again"
    )
    np.testing.assert_array_equal(again.outcomes, whole.outcomes)


def test_a_stopped_map_is_resumed_and_ends_the_same(whole, tmp_path, monkeypatch):
    monkeypatch.setattr(chunks, "CHUNK", 50)
    out, made = tmp_path / "stopped", []

    def stop(what: str, done: int, total: int, facts: str) -> None:
        if done >= 100:
            raise KeyboardInterrupt

    with refuses(Interrupted, "100", "195"):
        map_preventability(
            "r157/cut-in", whole.drivers, grid=GRID, out=out, callbacks=JobCallbacks(progress=stop)
        )
    kept = sorted((out / "chunks").iterdir())
    assert [one.name for one in kept] == ["000000.npy", "000001.npy"]
    kept[1].write_bytes(kept[1].read_bytes()[:-1])  # damaged: it is made again
    chunk = module._Run.chunk

    def counted(self, start: int, stop: int):
        made.append(start)
        return chunk(self, start, stop)

    monkeypatch.setattr(module._Run, "chunk", counted)
    resumed = map_preventability("r157/cut-in", whole.drivers, grid=GRID, out=out)
    assert made == [50, 100, 150]
    np.testing.assert_array_equal(resumed.outcomes, whole.outcomes)


def test_a_folder_with_another_map_or_something_else_is_refused(whole, tmp_path):
    with refuses(StorageError):
        map_preventability("r157/cut-in", whole.drivers, grid=GRID[:2], out=whole.folder)
    (tmp_path / "notes.txt").write_text("mine")
    with refuses(StorageError):
        map_preventability("r157/cut-in", "un-r157", grid=GRID, out=tmp_path)


def test_a_driver_of_one_s_own_and_one_that_fails(tmp_path):
    """A driver that brakes at once is not there any more; one that raises has no result."""
    file = tmp_path / "mine.py"
    file.write_text(HALT)
    found = map_preventability(
        "r157/cut-in", [f"{file}:Halts", f"{file}:Fails"],
        grid={"ego_speed": GridAxis("60 km/h", "90 km/h", 2), "gap": GridAxis(60.0, 90.0, 2)},
        out=tmp_path / "map",
    )  # fmt: skip
    halts, fails = (found.classes[name] for name in found.drivers)
    assert (halts == CellClass.AVOIDED).all()
    assert fails.tolist() == [[CellClass.AVOIDED] * 2, [CellClass.NO_RESULT] * 2]
    file.write_text(HALT + "\n# changed\n")
    with refuses(StorageError):
        map_preventability(
            "r157/cut-in", found.drivers,
            grid={"ego_speed": GridAxis("60 km/h", "90 km/h", 2), "gap": GridAxis(60.0, 90.0, 2)},
            out=tmp_path / "map",
        )  # fmt: skip


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"ego": "un-r158"}, UnknownNameError, "un-r157"),
        ({"ego": "un-r157", "models": ["fsn"]}, UnknownNameError, "fsn"),
        ({"ego": []}, InputError, "driver"),
        ({"ego": "fsm", "models": []}, InputError, "model"),
        ({"ego": ["fsm", "fsm"]}, InputError, "twice"),
        ({"ego": "fsm", "fixed": {"gap": 20.0}}, InputError, "held"),
        ({"ego": "fsm", "workers": 0}, InputError, "workers"),
    ],
)
def test_wrong_arguments_are_refused(tmp_path, arguments, error, message):
    with refuses(error, message):
        map_preventability("r157/cut-in", **({"grid": GRID, "out": tmp_path / "m"} | arguments))


def test_the_command_line(tmp_path, monkeypatch, capsys):
    out = tmp_path / "map"
    words = ["bridgegen", "preventability", "r157/deceleration", "--ego", "route-follower,fsm"]
    words += ["--grid", "deceleration=6:8:2", "--grid", "ego_speed=20:30:3", "--out", str(out)]
    monkeypatch.setattr("sys.argv", words)
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 0
    printed = capsys.readouterr().out
    for name in ("avoided", "preventable", "unpreventable"):
        assert name in printed.split()
    assert str(out / "preventability.html") in printed.replace("\n", "")
    page = (out / "preventability.html").read_text("utf-8")
    assert "bridgegen preventability r157/deceleration --ego route-follower --ego fsm" in page
    figures = json.loads((out / "summary.json").read_text())["drivers"]
    assert [one["preventable"] for one in figures] == [6, 0]  # all that the models avoid at 2 s


def test_an_error_of_the_command_line_is_one_message(monkeypatch, capsys):
    monkeypatch.setattr(
        "sys.argv",
        ["bridgegen", "preventability", "r157/cut-in", "--ego", "fsm", "--grid", "gap=1:2:0"],
    )
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    approve(capsys.readouterr().err, "--grid")
    assert not Path("preventability").exists()
