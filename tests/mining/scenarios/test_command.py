"""``bridgegen mine`` from recordings to scenarios and differences, by its files and its output."""

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest
from tests.approval import approve

from bridgegen.recordings.scenarios import mined
from bridgegen.scenario.exposure import exposure_of
from bridgegen.scenario.language.reader import load

SLOWER = Path(__file__).parents[3] / "docs" / "examples" / "slower-lead.yaml"
PAIRS, STEP = 52, 0.2


def write_approaches(folder):
    """Pairs of cars on one lane, one after the other, of which the second is faster."""
    path, rng = folder / "traffic.csv", np.random.default_rng(2)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(("time", "entity", "x", "y", "h", "speed"))
        for pair in range(PAIRS):
            speed, slower = rng.uniform(14.0, 26.0), rng.uniform(3.0, 5.0)
            gap = slower * rng.uniform(9.0, 11.0)
            for k in range(31):
                t = k * STEP
                for name, x, v in (
                    ("ego", speed * t, speed), ("lead", gap + 5.0 + (speed - slower) * t,
                                                speed - slower),
                ):  # fmt: skip
                    writer.writerow((f"{60 * pair + t:.1f}", f"{name} {pair}", f"{x:.3f}", 0, 0,
                                     f"{v:.3f}"))  # fmt: skip
    return path


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return write_approaches(tmp_path_factory.mktemp("traffic"))


@pytest.fixture(autouse=True)
def _few_replicates(monkeypatch):
    monkeypatch.setattr(mined, "REPLICATES", 20)


def test_it_writes_scenarios_their_fits_and_the_difference(cli, tmp_path, recording):
    out, mine = tmp_path / "mined", tmp_path / "my.yaml"
    mine.write_bytes(SLOWER.read_bytes())
    before = mine.read_bytes()
    code, text, err = cli("mine", recording, "--update", mine, "--keep", 0, "--out", out)
    assert code == 0, err
    assert mine.read_bytes() == before
    diff = (out / "my.yaml.diff").read_text(encoding="utf-8")
    assert diff in text
    assert f"--- {mine}\n+++ {mine}\n" in diff
    (none,) = [line for line in text.splitlines() if ": no scenario: 0 events; 5 are" in line]
    assert "cut-in" in none.split(":")[0].split(", ")
    scenario = load(out / "scenarios" / "slower-lead-mined.yaml")
    exposure = exposure_of(scenario)
    assert 47 <= exposure.encounters.count <= PAIRS
    assert exposure.encounters.hours == pytest.approx(2 * PAIRS * 6.0 / 3600, rel=0.02)
    assert {one.name for one in (out / "scenarios").iterdir()} == {
        "slower-lead-mined.yaml", "slower-lead-mined.html", "slower-lead-mined-distribution.xosc",
        "mined.owl",
    }  # fmt: skip
    page = (out / "recordings.html").read_text(encoding="utf-8")
    for name in ("yaml", "html"):
        assert f'href="scenarios/slower-lead-mined.{name}"' in page
    events = (out / "events.csv").read_text(encoding="utf-8")
    assert page.count('<figure id="approach-') == 3
    assert all(f"\napproach-{k}," in events for k in (1, PAIRS))

    texts = {one.name: one.read_bytes() for one in (out / "scenarios").iterdir()}
    (out / "scenarios" / "cut-in-mined.yaml").write_text("of an earlier call")
    code, text, _ = cli("mine", recording, "--scenario", mine, "--keep", 0, "--json", "--out", out)
    assert {one.name: one.read_bytes() for one in (out / "scenarios").iterdir()} == texts
    found = {one["of"]: one for one in json.loads(text)["mined"]}
    approve(found["cut-in"]["reason"], "47")
    assert found["slower-lead"]["scenario"] == str(out / "scenarios" / "slower-lead-mined.yaml")


def test_events_on_the_page_have_their_names_in_the_table(cli, tmp_path, recording):
    again = tmp_path / "again.csv"
    again.write_bytes(recording.read_bytes())
    out = tmp_path / "mined"
    code, _, err = cli("mine", recording, again, "--keep", 0, "--out", out)
    assert code == 0, err
    page = (out / "recordings.html").read_text(encoding="utf-8")
    with (out / "events.csv").open(newline="", encoding="utf-8") as file:
        rows = {row["name"]: row for row in csv.DictReader(file)}
    shown = re.findall(r"<figcaption[^>]*>(\S+): ego (\S+ \d+) of (\w+), from", page)
    assert {recording for _, _, recording in shown} == {"traffic", "again"}
    for name, ego, of in shown:
        assert (rows[name]["ego"], rows[name]["recording"]) == (ego, of)


def test_files_of_others_are_not_overwritten(cli, tmp_path, recording):
    mine = tmp_path / "my.yaml"
    mine.write_bytes(SLOWER.read_bytes())
    out = tmp_path / "mined"
    for name in ("scenarios", "my.yaml.diff"):
        (out / name).mkdir(parents=True)
        code, _, err = cli("mine", recording, "--update", mine, "--out", out)
        assert code == 2
        approve(" ".join(err.split()), "overwritten")
        (out / name).rmdir()


def test_what_cannot_be_updated_is_refused(cli, tmp_path, recording):
    one, other = tmp_path / "my.yaml", tmp_path / "more" / "my.yaml"
    other.parent.mkdir()
    for path in (one, other):
        path.write_bytes(SLOWER.read_bytes())
    code, _, err = cli("mine", recording, "--update", one, "--update", other)
    assert code == 2
    approve(" ".join(err.split()), "my.yaml")
    text = SLOWER.read_text(encoding="utf-8")
    one.write_text(text[: text.index("recorded:")] + "objective: harm\n", encoding="utf-8")
    code, _, err = cli("mine", recording, "--update", one)
    assert code == 2
    approve(" ".join(err.split()), "recorded")


def test_a_scenario_is_not_taken_from_where_it_would_be_replaced(cli, tmp_path, recording):
    out = tmp_path / "mined"
    mine = out / "scenarios" / "slower-lead-mined.yaml"
    mine.parent.mkdir(parents=True)
    mine.write_bytes(SLOWER.read_bytes())
    for option in ("--scenario", "--update"):
        code, _, err = cli("mine", recording, option, mine, "--out", out)
        assert code == 2
        approve(" ".join(err.split()), "elsewhere")
        assert mine.read_bytes() == SLOWER.read_bytes()
