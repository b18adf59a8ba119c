"""``bridgegen mine``: what was recorded, as a table, a page and CSV; nothing silently."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from markupsafe import escape
from tests.approval import approve, refuses
from tests.mining.lanes.test_lanelets import with_lanelets as write_two_lanes
from tests.openx.opendrive.kinds import model
from tests.pages import without_theme
from tests.recordings import writers as w

from bridgegen.base.errors import FileFormatError, InputError, StorageError
from bridgegen.jobs.mine.mine import mine
from bridgegen.jobs.mine.near_misses import PLAYED
from bridgegen.openx.opendrive.write import to_xml
from bridgegen.recordings.readers.formats import read
from bridgegen.recordings.readers.quality import Rule

pytestmark = pytest.mark.thorough


def rows(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_hours_and_kilometres_are_those_of_all_participants(tmp_path):
    out = tmp_path / "mined"
    (found,) = mine([w.write_ind(tmp_path)], out=out).recordings
    assert found.hours == pytest.approx(3 * 4.0 / 3600, rel=1e-9)
    lane_change = 22.0 * 4.0  # and 3.5 m to the side, within 0.1 m
    assert found.kilometres == pytest.approx((80.0 + 56.0 + lane_change) / 1000, abs=2e-4)
    assert found.participants == {"car": 2, "truck": 1}
    (row,) = rows(out / "recordings.csv")
    assert (row["n_car"], row["n_truck"], row["n_bus"]) == ("2", "1", "0")
    assert float(row["hours"]) == pytest.approx(found.hours, rel=1e-5)
    assert [one["rule"] for one in rows(out / "quality.csv")] == [rule.value for rule in Rule]


def test_a_broken_file_is_listed_and_the_others_are_read(cli, tmp_path):
    good, bad = w.write_ind(tmp_path), tmp_path / "bad.csv"
    bad.write_text("time,entity,x,y,h,speed\n0,a,1,2,3,x\n0,a,1,y,3,4\n")
    out = tmp_path / "mined"
    code, text, err = cli("mine", tmp_path, "--out", out, "--json")
    assert code == 0
    (skipped,) = json.loads(text)["skipped"]
    assert skipped["file"] == str(bad)
    assert skipped["reason"].startswith(f"{bad}, line 2: speed must be a number")
    assert [line for line in err.splitlines() if "bad.csv" in line] == [
        f"bridgegen: warning: not read: {skipped['reason']}"
    ]
    page = (out / "recordings.html").read_text(encoding="utf-8")
    assert escape(skipped["reason"]) in page
    # Only a gate that compares problems, or cannot know, ends with a status of its own.
    assert cli("mine", good, bad, "--out", out, "--fail-if", "skipped > 0")[0] == 3
    assert cli("mine", good, bad, "--out", out, "--fail-if", "skipped > 1")[0] == 0
    code, _, err = cli("mine", bad, "--out", tmp_path / "none")
    assert (code, "bad.csv, line 2" in err) == (2, True)
    assert not (tmp_path / "none").exists()


def test_an_extra_that_is_not_installed_costs_its_files_only(tmp_path, monkeypatch):
    good = w.write_ind(tmp_path)
    other = w.write_womd(tmp_path)

    def missing(path):
        if path == other:
            raise InputError(f"{path}: needs the extra 'parquet'")
        return read(path)

    monkeypatch.setattr("bridgegen.jobs.mine.mine.read", missing)
    found = mine([good, other], out=tmp_path / "mined")
    assert [path for path, _ in found.skipped] == [other]


def test_a_mistyped_name_and_a_time_step_end_it_at_once(tmp_path):
    good = w.write_ind(tmp_path)
    with refuses(FileFormatError, "typo.csv"):
        mine([good, tmp_path / "typo.csv"], out=tmp_path / "mined")
    with refuses(InputError, "time_step"):
        mine([good], time_step=9.0, out=tmp_path / "mined")


def late_brakers(folder, count):
    """Write recordings, in each of which a car brakes later and stops nearer to another."""
    folder.mkdir()
    for k in range(count):
        t = 0.1 * np.arange(80)
        v = np.clip(15.0 - 8.0 * np.clip(t - 2.0, 0.0, None), 0.0, None)
        x = np.append(0.0, np.cumsum(0.05 * (v[1:] + v[:-1])))
        stands = x[-1] + 5.0 + 0.04 * k
        lines = ["time,entity,x,y,h,speed,length,width,centre"]
        for i in range(len(t)):
            lines.append(f"{t[i]:.2f},late<b>,{x[i]},0,0,{v[i]},4.6,1.8,1.4")
            lines.append(f"{t[i]:.2f},there,{stands},0,0,0,4.6,1.8,1.4")
        (folder / f"late-{k:02}.csv").write_text("\n".join(lines) + "\n")


def test_the_page_of_many_recordings_begins_with_near_misses_that_play(tmp_path, page_of):
    late_brakers(tmp_path / "data", 22)
    found = mine(tmp_path / "data", keep=15, out=tmp_path / "mined")
    ttc = [item.event.event.found.ttc for item in found.replays]
    assert (len(ttc), ttc) == (15, sorted(ttc))
    page = page_of(tmp_path / "mined" / "recordings.html", 1440)
    assert page.evaluate("document.documentElement.scrollHeight") <= 6000
    figures = page.locator("figure.card")
    assert figures.count() == PLAYED
    box = figures.first.bounding_box()
    assert box["y"] + 0.5 * box["height"] < 900  # the first screen of 1440 by 900 shows it
    nearest = f"came within {ttc[0]:.2f} s of the car there"
    assert f"The car late<b> {nearest}" in figures.first.inner_text()
    assert nearest in page.locator(".banner").inner_text()
    assert page.locator(".banner b").inner_text() == "22 NEAR MISSES"
    assert "--ego reference" in page.locator(".banner code").inner_text()
    moves = figures.first.locator("animateTransform").all()
    assert max(len(set(one.get_attribute("values").split(";"))) for one in moves) > 20
    command = figures.nth(2).locator("figcaption > code").inner_text()
    assert command == f"bridgegen simulate {tmp_path / 'mined' / 'critical' / '0003.xosc'}"
    rows = page.locator("table.stacked").first.locator("tbody tr")
    assert rows.count() == 22 - PLAYED


@pytest.mark.parametrize("width", [390, 1440])
def test_no_table_of_the_page_is_cut(tmp_path, page_of, width):
    late_brakers(tmp_path / "data", 14)
    mine(tmp_path / "data", out=tmp_path / "mined")
    page = page_of(tmp_path / "mined" / "recordings.html", width)
    page.evaluate("for (const one of document.querySelectorAll('details')) one.open = true")
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    for table in page.locator(".wide").all():
        assert table.evaluate("one => one.scrollWidth - one.clientWidth") <= 0


def test_a_file_counts_once(tmp_path):
    path = w.write_ind(tmp_path)
    with pytest.raises(InputError, match="named twice"):
        mine([path, tmp_path], out=tmp_path / "mined")


def test_files_of_others_are_not_overwritten(tmp_path):
    path, out = w.write_ind(tmp_path), tmp_path / "mined"
    out.mkdir()
    (out / "recordings.csv").write_text("mine\n")
    with pytest.raises(StorageError, match="not overwritten"):
        mine([path], out=out)
    (out / "recordings.csv").unlink()
    mine([path], out=out)
    mine([path], out=out)


def test_names_of_strangers_are_text_on_the_page_and_in_tables(tmp_path):
    path = w.write_womd(tmp_path)
    whole = json.loads(path.read_text())
    whole["name"] = "=cmd()<script>alert(1)</script>"
    path.write_text(json.dumps(whole))
    mine([path], out=tmp_path / "mined")
    page = (tmp_path / "mined" / "recordings.html").read_text(encoding="utf-8")
    assert "<script" not in without_theme(page)
    assert "&lt;script&gt;" in page
    assert rows(tmp_path / "mined" / "recordings.csv")[0]["recording"].startswith("'=cmd()")


def test_the_command_prints_what_was_recorded(cli, tmp_path):
    path, out = w.write_highd(tmp_path), tmp_path / "mined"
    code, text, _ = cli("mine", path, "--out", out)
    assert code == 0
    assert "2 car, 1 truck" in " ".join(text.split())
    assert "resampled" in text
    code, text, _ = cli("mine", path, "--json", "--out", out)
    (one,) = json.loads(text)["recordings"]
    assert (one["participants"], one["format"]) == ({"car": 2, "truck": 1}, "levelX")


def test_the_command_says_what_is_wrong_without_a_traceback(cli, tmp_path):
    code, _, err = cli("mine", tmp_path / "none.csv", "--out", tmp_path / "mined")
    assert code == 2
    assert "none.csv" in err
    assert "Traceback" not in err


def test_lanes_are_in_the_tables_on_the_page_and_in_the_picture(cli, tmp_path):
    path, out = write_two_lanes(tmp_path), tmp_path / "mined"
    code, text, _ = cli("mine", path, "--out", out)
    assert code == 0
    assert "lanelets 1 2 100 %" in " ".join(text.split())
    (row,) = rows(out / "lanes.csv")
    assert (row["source"], row["carriageway"], row["lanes"]) == ("lanelets", "1", "2")
    assert float(row["width_m"]) == pytest.approx(3.5)
    assert rows(out / "recordings.csv")[0]["vehicles_on_lanes"] == "1"
    page = (out / "recordings.html").read_text(encoding="utf-8")
    assert page.count('<polyline class="lane"') == 8  # two borders each
    code, text, _ = cli("mine", path, "--json", "--out", out)
    found = json.loads(text)["recordings"][0]["lanes"]
    assert found["carriageways"][0]["states"] == int(row["states"])


def test_lanes_of_a_map_and_a_map_of_another_place(cli, tmp_path):
    path, out = w.write_ind(tmp_path), tmp_path / "mined"
    map_of = {}
    for name, shift in (("here", 0.0), ("elsewhere", 900.0)):
        roads = model("straight")
        (road,) = roads.roads
        start = replace(road.plan_view[0], x=-20.0, y=-6.0 + shift, hdg=0.0)
        map_of[name] = tmp_path / f"{name}.xodr"
        moved = replace(roads, roads=(replace(road, plan_view=(start, *road.plan_view[1:])),))
        map_of[name].write_bytes(to_xml(moved))
    code, _, err = cli("mine", path, "--map", map_of["here"], "--out", out)
    assert (code, err) == (0, "")
    assert {row["source"] for row in rows(out / "lanes.csv")} == {"map"}
    code, _, err = cli("mine", path, "--map", map_of["elsewhere"], "--out", out)
    assert code == 2
    approve(" ".join(err.split()), "vehicles")
    code, _, err = cli("mine", path, "--map", tmp_path / "none.xodr", "--out", out)
    assert code != 0
    assert "none.xodr" in err
    assert "Traceback" not in err
