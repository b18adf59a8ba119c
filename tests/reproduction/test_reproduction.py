"""A reproduction from start to finish: every number is its runs', however they were made."""

import csv
import itertools
import math
import re
import shlex
import sqlite3
import sys
import tomllib
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely.affinity import rotate, translate
from shapely.geometry import Point, box
from tests.approval import approve, refuses
from tests.pages import without_theme

import bridgegen as bg
from bridgegen.base.errors import InputError, Interrupted, StorageError
from bridgegen.cli import main
from bridgegen.jobs.compare.runs import RunsProgress
from bridgegen.jobs.search.restored import pipeline_of
from bridgegen.results.store import Store
from bridgegen.search.algorithms.evolved import PSO
from bridgegen_reproduction import (
    paper,
    pictures,
    protocol,
    reproduce,
    reproduction,
)
from bridgegen_reproduction.figures.crossroads import collision_points, crossing_of
from bridgegen_reproduction.figures.fronts import spread_curve
from bridgegen_reproduction.figures.look import DARK
from bridgegen_reproduction.protocol import PRINTED
from bridgegen_reproduction.runs import of

pytestmark = pytest.mark.thorough

COUNT = 3 * 2 * 2 + 3 * 2 * 2 + 2 * 2
"""Three methods without PPO, two scenarios, two seeds; again with perception; RS again, ideal."""


def table(folder: Path, name: str) -> list[dict[str, str]]:
    return list(csv.DictReader((folder / name).read_text("utf-8").splitlines()))


def rows(folder: Path) -> list[sqlite3.Row]:
    """A run's evaluations, read without any of our code."""
    connection = sqlite3.connect(folder / "run.sqlite")
    connection.row_factory = sqlite3.Row
    try:
        return list(connection.execute("SELECT * FROM evaluations ORDER BY id"))
    finally:
        connection.close()


def by_hand(folder: Path, k: int) -> dict[str, float]:
    """A run's numbers by the definitions of Section V."""
    found = rows(folder)
    good = [one for one in found if one["status"] == 0]
    d = np.array([one["d_min"] for one in good])
    v = 3.6 * np.array([one["v_d"] for one in good])
    fitness = 0.1703 * v - 0.8297 * d
    hits = [k for k, one in enumerate(found, 1) if one["critical"]]
    critical = [
        one["n_collision"] > 0 or (one["d_min"] < 2.0 and one["v_d"] >= 1.0) for one in good
    ]
    assert len(hits) == sum(critical)
    return {
        "evaluations": len(found),
        "critical": len(hits),
        "r_critic": len(hits) / len(found),
        "evaluations_to_k": hits[k - 1] if len(hits) >= k else math.inf,
        "avg_d_min": d.mean(), "median_d_min": np.median(d),
        "avg_v_d": v.mean(), "median_v_d": np.median(v),
        "avg_fitness": fitness.mean(), "median_fitness": np.median(fitness),
    }  # fmt: skip


def test_every_run_s_numbers_are_its_store_s(done):
    folder, _ = done
    told = table(folder, "runs.csv")
    assert len(told) == COUNT
    for row in told:
        for name, value in by_hand(folder / row["folder"], k=6).items():
            assert float(row[name]) == pytest.approx(value, abs=1e-12), (row["folder"], name)
        causes = [one["cause"] for one in rows(folder / row["folder"])]
        for label in ("perception", "planning", "control", "unavoidable"):
            expected = str(causes.count(label)) if row["part"] == "with-perception" else ""
            assert row[label] == expected


def test_table_6_is_of_the_runs(done):
    folder, _ = done
    runs = [one for one in table(folder, "runs.csv") if one["part"] == "as-printed"]
    lines = table(folder, "tables/table-6.csv")
    printed = {(o["objectives"], o["method"], o["quantity"]): o["paper"] for o in lines}
    assert printed["single", "pso", "avg_fitness"] == "16.59"
    assert printed["many", "nsga2-dt", "r_critic"] == "0.649"
    assert ("many", "random", "avg_fitness") not in printed
    groups = {"single": ("random", "pso"), "many": ("random", "nsga2-dt")}
    compared = set()
    for line in [*lines, *table(folder, "tables/table-6-others.csv")]:
        scenario, group = line.get("scenario", "paper-crossroads-s4"), groups[line["objectives"]]
        if line["method"] not in group:
            assert (line["method"], line["runs"]) == ("ppo", "0")
            continue
        quantity, is_relative = line["quantity"], line["quantity"] == "t_critic"
        samples = {
            name: np.array([
                float(one["evaluations_to_k" if is_relative else quantity])
                for one in runs
                if (one["scenario"], one["algorithm"]) == (scenario, name)
            ])
            for name in group
        }  # fmt: skip
        values = samples[line["method"]]
        if is_relative:
            best = min(np.median(one) for one in samples.values())
            values = values / best if best < math.inf else np.array([])
        assert int(line["runs"]) == len(values)
        assert int(line.get("never", np.isinf(values).sum())) == np.isinf(values).sum()
        if len(values) and np.isfinite(values).all():
            compared.add((scenario, quantity))
            for name, share in (("q1", 25), ("median", 50), ("q3", 75)):
                assert float(line[name]) == pytest.approx(np.percentile(values, share), abs=1e-12)
    assert ("paper-crossroads-s3", "t_critic") in compared
    assert ("paper-crossroads-s4", "median_fitness") in compared


def test_the_table_of_perception_is_of_the_stores(done):
    folder, result = done
    for line in table(folder, "tables/perception.csv"):
        runs = sorted((folder / "with-perception/runs").glob(
            f"{line['scenario']}-{line['algorithm']}-?"))  # fmt: skip
        assert len(runs) == 2
        causes = [one["cause"] for run in runs for one in rows(run) if one["cause"]]
        assert int(line["critical"]) == len(causes)
        assert int(line["evaluations"]) == 240
        for label in ("perception", "planning", "control", "unavoidable"):
            assert int(line[label]) == causes.count(label)
    pairs = {one["scenario"]: one for one in table(folder, "tables/perception-paired.csv")}
    assert set(pairs) == {"paper-crossroads-s3", "paper-crossroads-s4"}
    total = 0
    for scenario, pair in pairs.items():
        vanish = appear = by_cause = 0
        for seed in (0, 1):
            name = f"runs/{scenario}-random-{seed}"
            real, ideal = rows(folder / "with-perception" / name), rows(
                folder / "ideal-perception" / name)  # fmt: skip
            assert [one["u"] for one in real] == [one["u"] for one in ideal]
            both = zip(real, ideal, strict=True)
            change = [(a["critical"], b["critical"]) for a, b in both]
            vanish += change.count((1, 0))
            appear += change.count((0, 1))
            by_cause += sum(one["cause"] == "perception" for one in real)
        assert (int(pair["vanish"]), int(pair["appear"])) == (vanish, appear)
        assert vanish == by_cause  # the replay and the run with ideal perception agree
        total += int(pair["critical_sensors"])
    assert total > 0, "nothing was tested"
    assert sum(one.real for one in result.found.paired) == total


def _exporting_none(command):
    """A run's command with --keep 0."""
    return re.sub(r" --keep \d+", "", command) + " --keep 0"


def test_a_run_s_command_makes_the_same_run(done, tmp_path, monkeypatch):
    folder, _ = done
    told = table(folder, "runs.csv")
    (row,) = [one for one in told if one["folder"].endswith("with-perception/runs/"
              "paper-crossroads-s3-nsga2-dt-1")]  # fmt: skip
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", shlex.split(_exporting_none(row["command"])))
    with pytest.raises(SystemExit) as end:
        main()
    assert not end.value.code
    again = rows(tmp_path / "replay/with-perception/paper-crossroads-s3-nsga2-dt-1")
    for one, other in zip(again, rows(folder / row["folder"]), strict=True):
        left, right = dict(one), dict(other)
        assert {**left, "seconds": 0} == {**right, "seconds": 0}


def settled(folder: Path) -> dict[str, bytes]:
    """All files but the runs, without what is made of seconds."""
    found = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        if path.is_file() and "runs/" not in name and path.suffix not in (".lock", ".pdf"):
            found[name] = path.read_bytes()
    assert found.pop("times.csv")
    for ending in ("md", "csv", "tex"):
        assert found.pop(f"tables/table-6-runtime.{ending}")
    page = found["index.html"]
    found["index.html"] = re.sub(
        rb'(?s)<div class="card" id="table-6-runtime">.*?</table>', b"", page
    )
    assert len(found["index.html"]) < len(page)
    return found


def test_interrupted_and_gone_on_with_it_is_the_same(
    done, tiny, tmp_path, monkeypatch, capsys, without_ppo
):
    """Stopped in the middle of a run; then the command that it tells."""

    seen = []

    def stop(self, name: str, evaluations: int) -> None:
        if name == "paper-crossroads-s3-pso-0" and evaluations >= 80:
            seen.append(evaluations)
            if seen.count(80) == 2:  # as printed, it has ended; this is with perception
                raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    with monkeypatch.context() as patched:
        patched.setattr(RunsProgress, "batch", stop)
        with pytest.raises(Interrupted) as caught:
            reproduce(**tiny, workers=1)
    told = str(caught.value)
    stopped, _, command = told.partition("; resume with ")
    assert re.fullmatch(rf"stopped after 1\d of {COUNT} runs", stopped)
    assert not Path("reproduction/index.html").exists()
    with Store.open("reproduction/with-perception/runs/paper-crossroads-s3-pso-0") as store:
        assert len(store) == 80
    kept = Path("reproduction/as-printed/runs/paper-crossroads-s4-pso-1/run.sqlite")
    before = kept.stat().st_mtime_ns

    # Their bytes are tested by themselves, and they take as long as all else.
    monkeypatch.setattr(pictures, "pdf", lambda figure: b"%PDF")
    monkeypatch.setattr(sys, "argv", [*shlex.split(command.strip("'")), "--workers", "1"])
    with pytest.raises(SystemExit) as end:
        main()
    assert not end.value.code
    assert kept.stat().st_mtime_ns == before
    first, again = settled(done[0]), settled(Path("reproduction"))
    assert [name for name in first if first[name] != again.get(name)] == []
    assert set(again) == set(first)
    assert sum(name.endswith(".png") for name in first) == 8
    text = capsys.readouterr().out
    assert "PPO is missing: It needs the extra rl" in text.replace("\n", " ")
    assert "reproduction/index.html" in text


class Page(HTMLParser):
    """What is in a page."""

    def __init__(self) -> None:
        super().__init__()
        self.links: list[str] = []
        self.tags: list[str] = []
        self.ids: set[str] = set()
        self.text = ""
        self.policy = ""

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.tags.append(tag)
        self.links += [given[name] for name in ("href", "src", "srcset") if name in given]
        self.ids |= {given["id"]} if "id" in given else set()
        if given.get("http-equiv") == "Content-Security-Policy":
            self.policy = given["content"]

    def handle_data(self, data):
        self.text += data


def test_the_page_needs_no_network_and_its_links_lead_somewhere(done):
    folder, _ = done
    page = Page()
    page.feed(without_theme((folder / "index.html").read_text("utf-8")))
    assert "default-src 'none'" in page.policy
    assert "script" not in page.tags
    assert "script-src 'sha256-" in page.policy
    pictures = [link for link in page.links if link.startswith("data:image/png;base64,")]
    assert len(pictures) == 2 * len([*(folder / "figures").glob("*.png")]) == 16
    for link in page.links:
        if link.startswith("#"):
            assert link[1:] in page.ids
        elif link not in (*pictures, "data:,"):  # no icon
            assert (folder / link).exists(), link
    for row in table(folder, "runs.csv"):
        assert row["command"] in page.text
    for number in ("II", "III", "IV", "V", "VI"):
        assert f"Table {number}: " in page.text
    assert "{{" not in page.text


def test_the_readme_links_lead_somewhere(done):
    folder, _ = done
    text = (folder / "README.md").read_text("utf-8")
    links = re.findall(r"\]\(([^)]+)\)", text)
    assert len(links) > 40
    for link in links:
        assert (folder / link).exists(), link


def test_what_is_missing_is_named_with_the_reason(done):
    folder, result = done
    words = " ".join(" ".join(one) for one in result.in_short)
    approve(words, "bridgegen[rl]")
    text = (folder / "README.md").read_text("utf-8")
    for told in ("5.098", "5.089", "Town05", "prints no ranges", "route-follower", "0.541"):
        assert told in text
    lines = table(folder, "tables/claims.csv")
    by_word = {one["verdict"] for one in lines if "ppo" in (one["ahead"], one["behind"])}
    assert by_word == {"–"}
    assert {one["verdict"] for one in lines} >= {"agrees"}  # two seeds show nothing


def test_the_last_spread_is_the_run_s(done):
    folder, result = done
    protocol = result.found.protocol
    arguments = {**protocol.arguments(PRINTED), "out": folder / "as-printed"}
    told = result.found.commands["as-printed"]
    approve(told, "--algorithms", "--distinct", "--ego", "route-follower")
    comparison = bg.compare(**arguments, workers=1, deliver=False)
    measured = comparison.measured["paper-crossroads-s4"]
    for cell, values in measured.values.items():
        curve = spread_curve(comparison.records[cell], measured)
        assert curve[-1] == pytest.approx(values["spread"], nan_ok=True)
    assert not (folder / "as-printed" / "compare.html").exists()  # it was not asked for


def test_collisions_lie_in_both_bodies(done):
    folder, result = done
    runs = of(result.found.runs, PRINTED, "paper-crossroads-s3", "pso")
    run = folder / "as-printed/runs/paper-crossroads-s3-pso-0"
    crossing = crossing_of(run, runs)
    X = np.concatenate([one.X[one.collision] for one in runs])
    assert crossing.of == len(X) > 0
    assert len(crossing.collisions) == len(X)  # few enough to be drawn, all of them
    assert crossing.ends == (("P1", "P6"), ("P7", "P2"))
    pipeline = pipeline_of(bg.Run(run), "reproduce")
    rollout = pipeline.rollout(X)
    for row, place in enumerate(crossing.collisions[:20]):
        t = int(np.flatnonzero(rollout.distance[row, 1] <= 0.0)[0])
        for e in (0, 1):
            length, width, ahead = rollout.box[e]
            body = box(ahead - length / 2, -width / 2, ahead + length / 2, width / 2)
            body = rotate(body, rollout.h[row, e, t], origin=(0, 0), use_radians=True)
            body = translate(body, rollout.x[row, e, t], rollout.y[row, e, t])
            assert body.distance(Point(place)) < 1e-6
    figure = collision_points({"paper-crossroads-s3": crossing}, DARK)
    names = {text.get_text() for text in figure.axes[0].texts}
    assert {"P1", "P6", "P7", "P2", "C3"} <= names


def test_a_run_that_fails_is_a_gap_and_the_exit_status_tells(
    tmp_path, monkeypatch, capsys, without_ppo
):
    def broken(self):
        raise ZeroDivisionError("no <b>luck</b>")

    monkeypatch.setattr(PSO, "ask", broken)
    monkeypatch.setattr(reproduction, "pictures", lambda found, printed: {})
    words = ["reproduce", "--quick", "--iterations", "1", "--scenarios", "crossroads-s4"]
    monkeypatch.setattr(
        sys, "argv", ["bridgegen", *words, "--workers", "1", "--out", str(tmp_path / "r")]
    )
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 1
    told = " ".join(capsys.readouterr().out.split())
    assert "as-printed/paper-crossroads-s4-pso-0 (ZeroDivisionError: no <b>luck</b>)" in told
    page = (tmp_path / "r/index.html").read_text("utf-8")
    assert "<b>luck" not in page
    assert "&lt;b&gt;luck" in page
    lines = table(tmp_path / "r", "tables/table-6.csv")
    assert {one["runs"] for one in lines if one["method"] == "pso"} == {"0"}
    assert {one["runs"] for one in lines if one["quantity"] == "r_critic"} == {"0", "1"}


def test_ppo_is_run_where_its_packages_are(monkeypatch):
    asked = []

    def find(name):
        asked.append(name)
        return object()

    monkeypatch.setattr(protocol.importlib.util, "find_spec", find)
    assert protocol.available() == ("random", "ppo", "pso", "nsga2-dt")
    assert {"torch", "stable_baselines3", "gymnasium"} <= set(asked)
    monkeypatch.setattr(protocol.importlib.util, "find_spec", lambda name: None)
    assert protocol.available() == ("random", "pso", "nsga2-dt")


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"seeds": 0}, "1 <= seeds <= 1000 must hold, got 0"),
        ({"iterations": 0}, "1 <= iterations <= 10000 must hold, got 0"),
        ({"workers": 0}, "workers must be a number of processes, 1 to 1024"),
        ({"scenarios": ["crossroads-s4", "cut-in"]}, "got cut-in"),
        ({"scenarios": ["crossroads-s1"]}, "crossroads-s4 must be among the scenarios"),
        ({"scenarios": ["crossroads-s4", "crossroads-s4"]}, "each scenario must be named once"),
        ({"road_map": "no.xodr"}, "no.xodr"),
    ],
)
def test_mistakes_are_told_before_anything_is_run(tmp_path, arguments, told):
    with pytest.raises(InputError, match=re.escape(told)):
        reproduce(**{"out": tmp_path / "r", **arguments})
    assert not [*tmp_path.rglob("run.sqlite")]


KNOWN = [paper.short(name) for name in paper.SCENARIOS]


@given(st.lists(st.sampled_from([*KNOWN, "cut-in", "", "S4"]), max_size=6),
       st.integers(-2, 2000), st.integers(-2, 20_000))  # fmt: skip
def test_what_is_asked_for_is_run_or_refused(scenarios, seeds, iterations):
    try:
        made = protocol.make_protocol(
            seeds=seeds, iterations=iterations, scenarios=tuple(scenarios), out=Path("r"),
            road_map=None, junction=None,
        )  # fmt: skip
    except InputError:
        good = set(scenarios) <= set(KNOWN) and len(set(scenarios)) == len(scenarios)
        in_range = 1 <= seeds <= 1000 and 1 <= iterations <= 10_000
        assert not (good and in_range and paper.short(paper.MAIN) in scenarios)
        return
    assert {paper.short(name) for name in made.scenarios} == set(scenarios)
    assert len(made.scenarios) == len(scenarios)
    cells = [(part.name, cell) for part, cell in itertools.islice(made.cells(), 500)]
    assert len(set(cells)) == len(cells)
    assert made.scenarios[0] == paper.MAIN
    assert shlex.split(made.command())[:2] == ["bridgegen", "reproduce"]


def test_a_folder_of_something_else_is_left_alone(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    with refuses(StorageError):
        reproduce(out=tmp_path)
    assert [one.name for one in tmp_path.iterdir()] == ["mine.txt"]


def test_quick_is_one_seed(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["bridgegen", "reproduce", "--quick", "--seeds", "3"])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    approve(capsys.readouterr().err, "--quick")


def test_the_citation_has_the_version():
    root = Path(__file__).parents[2]
    house = tomllib.loads((root / "pyproject.toml").read_text("utf-8"))["project"]
    assert f"\nversion: {house['version']}\n" in (root / "CITATION.cff").read_text("utf-8")


def test_the_default_is_the_paper_s():
    made = protocol.make_protocol(
        seeds=10, iterations=paper.ITERATIONS,
        scenarios=tuple(KNOWN), out=Path("r"),
        road_map=None, junction=None,
    )  # fmt: skip
    assert made.budget == 1000
    assert made.command() == "bridgegen reproduce --seeds 10 --out r"
    assert made.scenarios[0] == "paper-crossroads-s4"
