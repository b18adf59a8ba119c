"""The triage of real runs: what is recorded, exported, shown and judged."""

import json
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from tests.approval import approve

import bridgegen as bg
from bridgegen.assess.conflict.harm import NEAR_MISS
from bridgegen.cli.verdict.of_run import figures_of
from bridgegen.jobs.search.restored import pipeline_of
from bridgegen.pages.findings_payload import triage_payload
from bridgegen.results.store import Store
from bridgegen.scenario.language.reader import shipped_text
from bridgegen.search.triage import JSON_FILE
from bridgegen.search.triage.minimal import Ladder
from bridgegen.search.triage.modes import keys_of
from bridgegen.search.triage.moves import nearest

pytestmark = pytest.mark.thorough

GIVEN = {
    "algorithm": "random", "budget": 150, "seed": 0, "ego": "route-follower", "keep": 4,
    "objective": {"harm": None},
}  # fmt: skip


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    place = tmp_path_factory.mktemp("runs") / "s3"
    return bg.run_search("crossroads-s3", **GIVEN, workers=2, out=place)


@pytest.fixture(scope="module")
def pipeline(run):
    return pipeline_of(run, "resume", causes=True)


def facts(path):
    return json.loads(path.with_suffix(".json").read_text("utf-8"))


def test_all_harmful_rows_are_in_a_mode(run):
    frame = run.frame()
    harmful = frame["harm"] >= NEAR_MISS
    assert 20 < harmful.sum() < 140
    assert sum(one.count for one in run.modes) == run.triage.bound.harmful == harmful.sum()
    assert len({(one.title, one.cause) for one in run.modes}) == len(run.modes)
    for one in run.modes:
        worst = frame.loc[one.worst]
        assert worst["harm"] == one.harm
        for name in ("conflict", "conflict_type", "responsible"):
            assert (frame.loc[list(one.examples), name] == getattr(one, name)).all()
        assert set(frame.loc[list(one.examples), "rule"]) <= {rule for rule, _ in one.rules}
        assert sum(n for _, n in one.rules) == one.count
        assert one.place == "in the junction"
        assert one.partner == "car"


def test_one_seed_gives_one_record_whoever_simulates(run, tmp_path):
    again = bg.run_search("crossroads-s3", **GIVEN, workers=1, out=tmp_path / "again")
    mine, theirs = ((one.folder / JSON_FILE).read_bytes() for one in (again, run))
    assert mine == theirs
    for path in (*run.scenarios, *run.minimal_scenarios):
        assert (again.folder / "critical" / path.name).read_bytes() == path.read_bytes()


def test_resume_makes_it_again(run):
    path = run.folder / JSON_FILE
    before = path.read_bytes()
    path.write_bytes(b"damaged")
    assert bg.resume(run.folder, workers=2).triage == run.triage
    assert path.read_bytes() == before


def test_the_worst_of_each_mode_is_exported_first(run):
    found = [facts(path) for path in run.scenarios]
    assert len(found) == 4
    robust = [one["robustness"] >= 0.5 for one in found]
    assert robust == sorted(robust, reverse=True)
    shown = {one.shown for one in run.modes}
    assert found[0]["row"] == run.modes[0].shown
    assert {one["row"] for one in found[: len(shown)]} <= shown or len(shown) < 4
    for one in found:
        near = run.triage.neighbourhood(one["row"])
        assert one["robustness"] == near.robustness
        assert near.rows == 32
        assert one["cause"] == near.cause
        mode = run.modes[one["mode"] - 1]
        assert one["name"] in mode.exports


def test_minimal_scenarios_come_to_the_harm_of_their_mode(run, pipeline):
    assert run.minimal_scenarios
    by_name = {one.minimal.name: one for one in run.modes if one.minimal}
    for path in run.minimal_scenarios:
        mode = by_name[path.stem]
        result = bg.simulate_file(path)
        told = facts(path)
        assert result.metrics["n_collision"] == told["metrics"]["n_collision"]["value"]
        assert told["sentence"] == mode.minimal.sentence
        assert told["metrics"]["harm"]["value"] == mode.minimal.harm >= NEAR_MISS
        X = np.array([mode.minimal.x])
        assert not pipeline.space.violations(X)
        with Store.open(run.folder) as store:
            base = store.read(mode.shown, mode.shown + 1).X
        came = pipeline.try_all(X, noise=base)
        (key,) = keys_of(came.findings, pipeline.runner.kinds, came.place.tolist(), [""])
        names = ("conflict", "conflict_type", "responsible", "partner", "place")
        assert key[:5] == tuple(getattr(mode, name) for name in names)
        for kind in ("owl", "xodr", "json"):
            assert path.with_suffix(f".{kind}").is_file()


def test_one_more_step_towards_nominal_removes_the_harm(tmp_path):
    run = bg.run_search("crossroads-s4", **GIVEN, workers=2, out=tmp_path / "s4")
    pipeline = pipeline_of(run, "resume", causes=True)
    space, tried = pipeline.space, 0
    for mode in run.modes:
        for one in mode.minimal.conditions if mode.minimal else ():
            if not one.confirmed:
                continue
            k = space.variables.index(one.name)
            ladder = Ladder.of(space, np.array(mode.minimal.x))
            wish = np.tile(ladder.start, (2, 1))
            way = np.sign(one.nominal - one.value)
            wish[:, k] = one.limit, one.limit + way * one.step
            with Store.open(run.folder) as store:
                base = np.repeat(store.read(mode.shown, mode.shown + 1).X, 2, axis=0)
            came = pipeline.try_all(nearest(space, wish), noise=base)
            assert came.harmful.tolist() == [True, False], one
            tried += 1
    assert tried


def test_rows_are_driven_again_as_they_were(run, pipeline):
    with Store.open(run.folder) as store:
        rows = store.read()
        harm = rows.metrics[:, store.metrics.index("harm")]
    assert (rows.findings.implausible == "").all()
    came = pipeline.try_all(rows.X)
    assert (came.harm == harm).all()
    assert (pipeline.try_all(rows.X, noise=rows.X).harm == harm).all()
    assert (came.findings.rule == rows.findings.rule).all()


def test_the_summary_ends_with_what_matters(run, capsys):
    from bridgegen.cli.terminal.search import print_summary

    print_summary(run, 1.0)
    brief = capsys.readouterr().out
    first, head, *rest = brief.splitlines()
    count = f"{len(run.modes)} failure mode"
    approve(first, count, "route-follower", Path(run.settings.scenario).stem)
    assert "worst MAIS3+" in head
    modes = rest[: len(run.modes)]
    assert all(len(line) <= 100 for line in modes)
    assert [int(line.split()[2].replace(",", "")) for line in modes] == [m.count for m in run.modes]
    assert "How common: " in brief
    assert f"Report: {run.report}" in brief
    print_summary(run, 1.0, verbose=True)
    out = capsys.readouterr().out
    assert out.endswith(brief)
    assert f"\n{run.modes[0].count:>5} × {run.modes[0].title}; MAIS3+ " in out
    assert "quick causes" in out
    assert "simplest: " in out


def test_figures_of_the_triage_are_judged(run, tmp_path, cli):
    figures = figures_of(run)
    assert figures["modes"] == len(run.modes)
    assert figures["robust"] == run.triage.robust
    assert figures["worst_severity"] == max(one.severity for one in run.modes)
    assert figures["harmful.upper"] == run.triage.bound.space.high
    junit = tmp_path / "junit.xml"
    criteria = ["--fail-if", "harmful.upper > 0.99", "--fail-if", "modes > 0"]
    assert cli("resume", run.folder, *criteria, "--junit", junit)[0] == 3
    assert run.triage.bound.sentence in junit.read_text("utf-8")
    cases = {case.get("name"): case for case in ElementTree.parse(junit).getroot().iter("testcase")}
    failed = {name for name, case in cases.items() if case.find("failure") is not None}
    assert "not harmful.upper > 0.99" in cases.keys() - failed
    assert "not modes > 0" in failed


def test_a_driver_without_failures_leaves_an_empty_export_and_a_bound(tmp_path, capsys):
    from bridgegen.cli.terminal.search import print_summary

    run = bg.run_search(
        "crossroads-s1", ego="reference", objective={"harm": None}, algorithm="random", budget=60,
        out=tmp_path / "run",
    )  # fmt: skip
    assert run.modes == ()
    assert run.scenarios == run.minimal_scenarios == ()
    assert run.triage.bound.space.high == pytest.approx(1.0 - 0.025 ** (1 / 60))
    print_summary(run, 1.0)
    out = capsys.readouterr().out
    approve(out, "60", "crossroads-s1")
    approve(run.verdict)
    assert str(run.report) in out
    assert figures_of(run)["modes"] == 0


def even(name, folder):
    """Return the file of a scenario whose weather is even: more of its rows are in bad weather."""
    path = folder / f"{name}.yaml"
    text = shipped_text(name).decode()
    path.write_text(text.replace("\naxes:", "\npriors: even\naxes:", 1), "utf-8")
    return path


def test_a_failure_among_fresh_draws_alone_is_one_and_is_exported(tmp_path, capsys):
    from bridgegen.cli.terminal.search import print_summary

    run = bg.run_search(
        even("bus-pulls-out", tmp_path), ego="reference", budget=300, seed=4, causes=False,
        out=tmp_path / "run",
    )  # fmt: skip
    assert run.triage.bound.harmful == 0
    assert run.verdict == "fails"
    assert run.scenarios == run.modes == ()
    assert len(run.fresh_scenarios) == run.triage.bound.space.harmful == run.triage.bound.failures
    for path in run.fresh_scenarios:
        facts = json.loads(path.with_suffix(".json").read_text("utf-8"))
        assert facts["metrics"]["harm"]["value"] >= NEAR_MISS
        found = bg.simulate_file(path)
        assert found.metrics["harm"] == facts["metrics"]["harm"]["value"]
    print_summary(run, 1.0)
    out = capsys.readouterr().out
    approve(out, "256", "bus-pulls-out")
    assert str(run.fresh_scenarios[0]) in out
    assert figures_of(run)["modes"] == 1
    assert triage_payload(run.triage)["bound"]["failures"] == 1  # the page's title depends on it
    page = run.report.read_text("utf-8")
    assert "These draws are exported: critical/fresh-01.xosc" in page
    assert "No scenario is exported" not in page


def test_a_run_says_how_many_excused_collisions_a_careful_driver_avoids(tmp_path):
    run = bg.run_search(
        even("cut-out", tmp_path), ego="reference", budget=200, seed=0, algorithm="random", keep=2,
        causes=False, out=tmp_path / "run",
    )  # fmt: skip
    said = re.search(r"careful driver avoids (\d+) of (\d+) coll", run.triage.bound.sentence)
    avoided, again = map(int, said.groups())
    frame = run.frame()
    excused = frame[(frame["conflict"] == "contact") & frame["implausible"].isna()]
    excused = excused[excused["harm"] < NEAR_MISS]
    assert again == len(excused)
    X = excused[list(bg.model("cut-out").columns)].to_numpy()
    clean = np.zeros(len(X), bool)
    for driver in ("careful", "careful-fsm"):
        others = bg.model("cut-out", ego=driver).evaluate(X)
        clean |= (others["conflict"] != "contact") & (others["harm"] < NEAR_MISS)
    assert avoided == clean.sum() > 0


def test_only_failures_are_exported_also_with_the_paper_s_rule(tmp_path, capsys):
    from bridgegen.cli.terminal.search import print_summary

    run = bg.run_search(
        "crossroads-s3", ego="route-follower", algorithm="random", budget=100, keep=8,
        objective="paper", out=tmp_path / "run",
    )  # fmt: skip
    frame, found = run.frame(), [facts(path) for path in run.scenarios]
    assert len(found) == 8
    assert all(one["critical"] for one in found)
    assert run.settings.optimised["rule"] == "thresholds"
    assert all(frame.loc[one["row"], "harm"] >= NEAR_MISS for one in found)
    assert all(one["implausible"] is None for one in found)
    shown = {one.shown for one in run.modes if frame.loc[one.shown, "critical"]}
    assert shown <= {one["row"] for one in found}
    print_summary(run, 1.0, verbose=True)
    out = capsys.readouterr().out
    assert out.startswith("scenario")
    assert f"{run.triage.bound.harmful} of 100 evaluations" in out


def test_a_run_without_failures_exports_none_and_says_so(tmp_path, capsys):
    from bridgegen.cli.terminal.search import print_summary

    run = bg.run_search(
        "crossroads-s2", ego="reference", algorithm="random", budget=60, objective="paper",
        triage="none", out=tmp_path / "run",
    )  # fmt: skip
    assert run.summary.critical  # by the paper's thresholds
    assert not list((run.folder / "critical").iterdir())
    print_summary(run, 1.0, verbose=True)
    out = capsys.readouterr().out
    approve(out, "scenarios", "FAILURE")
    assert "No scenario is exported: only failures are." in run.report.read_text("utf-8")


def test_neighbours_of_a_noisy_driver_have_its_random_numbers():
    from bridgegen.engine.options import PipelineOptions
    from bridgegen.engine.pipeline import Pipeline
    from bridgegen.scenario.language.reader import load

    scenario = load("crossroads-s4")
    space = scenario.space()
    pipeline = Pipeline(scenario, space, PipelineOptions(ego="reference"))
    X = space.decode(np.random.default_rng(0).random((2, space.n_var)))
    one, other = ({n: X[[k], i] for i, n in enumerate(space.names)} for k in (0, 1))
    simulator, roads = pipeline.runner.embedded, pipeline.runner._roads
    rows = np.zeros(1, np.int64)

    def keys(values, noise=None):
        given = None if noise is None else simulator.noise_keys(noise, 1)
        batch = simulator.batch(roads, rows, values, noise=given)
        return batch.state.key.tolist()

    assert keys(one) != keys(other)
    assert keys(other, noise=one) == keys(one)


def test_a_minimal_file_of_a_noisy_driver_gives_the_recorded_metrics_to_the_last_bit(tmp_path):
    """Its storyboard states the key of the random numbers that it was found with."""
    run = bg.run_search(
        "paper/crossroads-s3", ego="reference", objective={"harm": None}, budget=200, keep=1,
        seed=2, out=tmp_path / "run",
    )  # fmt: skip
    assert run.minimal_scenarios
    for path in run.minimal_scenarios:
        told, result = facts(path), bg.simulate_file(path)
        assert told["noise_key"] in path.read_text("utf-8")
        both = {*told["metrics"]} & {*result.metrics}
        assert {"d_min", "v_d", "n_collision"} <= both
        for name in both:
            assert told["metrics"][name]["value"] in (result.metrics[name], None)


def test_a_minimal_scenario_that_is_not_harmful_as_exported_is_not_exported(tmp_path):
    from bridgegen.jobs.search.critical import _write_minimal

    run = bg.run_search("crossroads-s4", **GIVEN, workers=2, out=tmp_path / "s4")
    pipeline = pipeline_of(run, "resume", causes=True)
    mode = next(one for one in run.modes if one.minimal and one.minimal.conditions)
    assert _write_minimal(pipeline, mode, mode.minimal, tmp_path) == ()
    nominal = tuple(pipeline.space.row({}).tolist())
    harmless = mode.minimal.model_copy(update={"x": nominal, "name": "minimal-99"})
    (problem,) = _write_minimal(pipeline, mode, harmless, tmp_path)
    approve(problem, "exported")
    assert not list(tmp_path.glob("minimal-99*"))
