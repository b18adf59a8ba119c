"""A risk of a catalogue scenario: what it says is what its rows say, whoever counts them."""

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest
from markupsafe import escape
from tests.approval import approve, refuses
from tests.pages import without_theme

import bridgegen as bg
from bridgegen.assess.conflict.harm import NEAR_MISS
from bridgegen.base.errors import InputError, StorageError
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.jobs.frame import JobCallbacks
from bridgegen.jobs.risk.experiment import Experiment
from bridgegen.jobs.risk.ledger import BATCHES
from bridgegen.jobs.risk.outcomes import Column, outcomes
from bridgegen.jobs.risk.risk import estimate_risk
from bridgegen.pages.birdseye import ASPHALT
from bridgegen.pages.templates import number, odds

pytestmark = pytest.mark.thorough

SCENARIO, DRIVER = "crossroads-s1", "route-follower"
GIVEN = {"ego": DRIVER, "exposure": "uniform", "method": "mc", "precision": 0.0, "budget": 1200}

EXAMPLE = Path(__file__).parents[2] / "docs/examples/cut-in-exposure.yaml"


@pytest.fixture(scope="module")
def risk(tmp_path_factory):
    return estimate_risk(SCENARIO, out=tmp_path_factory.mktemp("risk") / "one", **GIVEN)


def files(folder):
    return {
        one.name: one.read_bytes()
        for one in folder.iterdir()
        if one.is_file() and one.name != "settings.json"
    }


def said(folder, name="risk.json"):
    found = json.loads((folder / name).read_text())
    found.pop("command")
    return found


def test_outcomes_are_those_of_a_search(risk):
    exposure = risk.exposure
    pipeline = Pipeline(exposure.scenario, exposure.space, PipelineOptions(ego=DRIVER))
    pipeline.choose_objective()
    X = exposure.sample(300, 5).X
    searched = pipeline.evaluate(X)
    found = outcomes(pipeline, X, "ego")
    harm = searched.metrics[:, pipeline.metrics.index("harm")]
    severity = searched.metrics[:, pipeline.metrics.index("severity")]
    ok = found.values[:, Column.RESULT] == 1.0
    assert ok.all()
    assert np.array_equal(found.values[:, Column.OWN] >= NEAR_MISS, harm >= NEAR_MISS)
    harmful = harm >= NEAR_MISS
    assert harmful.any()
    assert not harmful.all()
    collides = searched.findings.conflict[harmful] == "contact"
    assert np.array_equal(found.values[harmful, Column.SCORE] >= 0.6, collides)
    assert (found.values[~harmful, Column.SCORE] < NEAR_MISS).all()
    assert np.array_equal(found.values[harmful, Column.SEVERITY], severity[harmful])
    words = [found.modes[int(k)] for k in found.values[harmful, Column.MODE]]
    rules = searched.findings.rule[harmful]
    assert all(rule in one for rule, one in zip(rules, words, strict=True))
    every = outcomes(pipeline, X, "any").values[:, Column.SCORE]
    assert (every >= found.values[:, Column.SCORE]).all()


def test_it_counts_what_its_table_holds(risk):
    found = said(risk.folder)
    lines = (risk.folder / "harmful.csv").read_text().splitlines()
    kinds = [row["conflict"] for row in csv.DictReader(lines)]
    assert found["per_encounter"]["conflict"]["estimate"] == pytest.approx(len(kinds) / 1200)
    collisions = kinds.count("collision")
    assert found["per_encounter"]["collision"]["estimate"] == pytest.approx(collisions / 1200)
    modes = sum(one["estimate"] for one in found["by_mode"].values())
    assert modes == pytest.approx(found["per_encounter"]["collision"]["estimate"])
    assert found["evaluations"] == 1200
    assert found["per_hour"]["collision"] is None
    assert max(one["distance"] for one in found["parameters"].values()) > 0.2


def test_the_most_likely_encounter_of_each_failure_mode_is_one(risk):
    exposure = risk.exposure
    pipeline = Pipeline(exposure.scenario, exposure.space, PipelineOptions(ego=DRIVER))
    assert [one.mode for one in risk.most_likely] == list(risk.by_mode)[:5]
    assert len(risk.most_likely) > 1
    for one, said_of in zip(risk.most_likely, said(risk.folder)["most_likely"], strict=True):
        found = outcomes(pipeline, one.x[np.newaxis], "ego")
        assert found.values[0, Column.SCORE] >= 0.6
        assert found.modes == (one.mode,)
        again = bg.simulate_file(risk.folder / f"{said_of['files']}.xosc")
        assert again.metrics["n_collision"] == 1.0
        assert again.metrics["harm"] >= NEAR_MISS
        assert said_of["values"] == exposure.space.values(one.x)


def test_none_of_its_failure_mode_was_drawn_that_is_likelier(tmp_path):
    found = estimate_risk(
        "cut-in", ego="route-follower", exposure=EXAMPLE, event="conflict", method="mc",
        precision=0.0, budget=3000, out=tmp_path / "likely",
    )  # fmt: skip
    outcome, exposure = found.weighted.outcomes, found.exposure
    X = exposure.from_normal(found.weighted.Z)
    assert found.most_likely
    for one in found.most_likely:
        same = outcome[:, Column.MODE] == found.modes.index(one.mode)
        drawn = exposure.log_density(X[same & (outcome[:, Column.SCORE] >= NEAR_MISS)])
        assert exposure.log_density(one.x[np.newaxis])[0] >= drawn.max()


def test_the_page_says_it_without_scripts(risk):
    page = (risk.folder / "risk.html").read_text()
    assert "The probability of a collision that the ego is responsible for" in page
    assert "<script" not in without_theme(page)
    assert not re.search(r"(src|href)=.https?:", page)
    assert page.count("<figure>") == len(risk.exposure.marginals)
    (crash,) = said(risk.folder)["crash_types"]
    assert (crash["percent"], crash["country"], crash["year"]) == (4.44, "US", 2004)
    assert f"{crash['type']} is the type of 4.4 % of crashes" in page
    assert "DOT HS 810 767" in page


def test_the_most_likely_harm_is_seen_first_on_its_road_with_its_sentence(risk):
    page = (risk.folder / "risk.html").read_text()
    first, second = risk.most_likely[:2]
    assert page.index(first.picture) < page.index("How likely") < page.index(second.picture)
    assert str(escape(first.sentence)) in page
    assert first.sentence.startswith("The ego")
    asphalt = f'fill="{ASPHALT}"'
    assert asphalt in first.picture.split("<animateTransform")[0]  # below all that moves
    p = risk.by_mode[first.mode].probability.estimate
    assert f"<b>{odds(p)} {'of ' if p >= 0.1 else ''}encounters</b>" in page


@pytest.mark.parametrize("at", [1, 700])
def test_stopped_and_gone_on_it_is_the_same(risk, tmp_path, at):
    def stop(what, done, total, facts):
        if done >= at:
            raise KeyboardInterrupt

    folder = tmp_path / "two"
    given = GIVEN | {"budget": 4000, "method": "subset"}
    whole = estimate_risk(SCENARIO, out=tmp_path / "whole", **given)
    with refuses(bg.errors.Interrupted, "crossroads-s1"):
        estimate_risk(SCENARIO, out=folder, callbacks=JobCallbacks(progress=stop), **given)
    estimate_risk(SCENARIO, out=folder, **given)
    assert said(folder) == said(whole.folder)
    assert files(folder)["harmful.csv"] == files(whole.folder)["harmful.csv"]


def test_damaged_and_hostile_batches_are_simulated_again(risk, tmp_path):
    import shutil

    folder = tmp_path / "copy"
    shutil.copytree(risk.folder, folder)
    batches = sorted((folder / BATCHES).iterdir())
    batches[0].write_bytes(batches[0].read_bytes()[:100])
    with (folder / BATCHES / batches[-1].name).open("wb") as file:
        np.save(file, np.array([print], dtype=object), allow_pickle=True)
    estimate_risk(SCENARIO, out=folder, **GIVEN)
    assert said(folder) == said(risk.folder)


def test_processes_find_what_threads_find(risk, tmp_path):
    found = estimate_risk(SCENARIO, out=tmp_path / "two", workers=2, **GIVEN)
    assert said(found.folder) == said(risk.folder)
    assert files(found.folder)["harmful.csv"] == files(risk.folder)["harmful.csv"]


def test_spread_rows_stand_for_the_road():
    """Their weights are a density over another one: 1 on average, whatever the exposure."""
    exposure = bg.read_exposure(EXAMPLE)
    pipeline = Pipeline(exposure.scenario, exposure.space, PipelineOptions(ego="careful"))
    experiment = Experiment(pipeline, exposure, None, "ego", None, print)
    Z, weights = experiment.spread(20_000, np.random.default_rng(1))
    assert Z.shape == (20_000, exposure.dimensions)
    assert weights.mean() == pytest.approx(1.0, abs=4.0 * weights.std() / 20_000**0.5)
    there = weights > 0.0
    assert experiment.feasible(Z[there]).all()
    X = exposure.from_normal(Z[there])
    speeds = X[:, exposure.space.index("ego_speed")]
    road = exposure.sample(20_000, 1).X[:, exposure.space.index("ego_speed")]
    mean = np.average(speeds, weights=weights[there])
    assert mean == pytest.approx(road.mean(), abs=0.3)
    assert speeds.std() > 1.3 * road.std()


def test_spread_rows_take_the_single_values_of_a_range():
    exposure = bg.read_exposure("lead-brakes-new-york")
    pipeline = Pipeline(exposure.scenario, exposure.space, PipelineOptions(ego="careful"))
    experiment = Experiment(pipeline, exposure, None, "ego", None, print)
    Z, weights = experiment.spread(20_000, np.random.default_rng(1))
    assert weights.mean() == pytest.approx(1.0, abs=4.0 * weights.std() / 20_000**0.5)
    rain = exposure.from_normal(Z)[:, exposure.space.index("precipitation")]
    there = weights > 0.0
    assert there.mean() > 0.5
    assert np.average(rain[there] > 0.0, weights=weights[there]) == pytest.approx(0.066, abs=0.01)


def test_all_conflicts_are_those_that_count_and_the_others(tmp_path):
    found = estimate_risk(
        "cut-in", ego="careful", exposure=EXAMPLE, event="conflict", count="any", method="mc",
        precision=0.0, budget=3000, out=tmp_path / "any",
    )  # fmt: skip
    every, own = found.probability("conflict"), found.preventable.probability
    assert 0.0 <= own.estimate < every.estimate
    met = found.exposure.encounters
    rate = found.rate("conflict", "h")
    assert rate.estimate == pytest.approx(every.estimate * met.count / met.hours)
    assert rate.low < every.low * met.count / met.hours < every.high * met.count / met.hours
    assert rate.high > every.high * met.count / met.hours


def test_a_search_s_run_helps_and_counting_agrees(tmp_path):
    run = bg.run_search(
        SCENARIO, ego=DRIVER, budget=150, seed=1, out=tmp_path / "run", triage="none", keep=0
    )
    found = estimate_risk(
        SCENARIO, ego=DRIVER, exposure="uniform", method="importance", budget=6000, precision=0.0,
        start=run.folder, check=1500, out=tmp_path / "risk",
    )  # fmt: skip
    p, counted = found.probability("collision"), found.check.probability(0.6)
    assert p is not None
    assert p.low <= counted.high
    assert counted.low <= p.high
    assert found.weighted.evaluations <= 6000


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "crossroads-s1 has no exposure"),
        ({"exposure": EXAMPLE}, "must be that of crossroads-s1, got one of cut-in"),
        ({"exposure": "uniform", "event": "harm"}, "unknown event 'harm'"),
        ({"exposure": "uniform", "method": "magic"}, "unknown method 'magic'"),
        ({"exposure": "uniform", "count": "all"}, "unknown count 'all'"),
        ({"exposure": "uniform", "ego": "nobody"}, "unknown ego driver 'nobody'"),
        ({"exposure": "uniform", "budget": 3}, "--budget must be 20 to"),
        ({"exposure": "uniform", "precision": 1.0}, "--precision must be 0 to 0.999"),
        ({"exposure": "uniform", "seed": -1}, "--seed must be at least 0"),
        ({"exposure": "uniform", "check": -1}, "--check must be 0 to"),
    ],
)
def test_what_is_wrong_is_said_and_nothing_written(tmp_path, given, message):
    with pytest.raises(InputError, match=re.escape(message)):
        estimate_risk(SCENARIO, out=tmp_path / "new", **given)
    assert not (tmp_path / "new").exists()


def test_folders_of_others_are_left_alone(risk, tmp_path):
    (tmp_path / "thesis.txt").write_text("mine")
    with refuses(StorageError):
        estimate_risk(SCENARIO, out=tmp_path, **GIVEN)
    with refuses(StorageError):
        estimate_risk(SCENARIO, out=risk.folder, **GIVEN, seed=9)


def test_a_scenario_file_of_openscenario_is_refused(risk, tmp_path):
    with pytest.raises(InputError, match="logical scenario"):
        estimate_risk(risk.folder / "most-likely-1.xosc", exposure="uniform", out=tmp_path / "x")


def test_the_command_judges_and_prints(cli, tmp_path):
    words = ["risk", SCENARIO, "--ego", DRIVER, "--exposure", "uniform", "--method", "mc"]
    words += ["--precision", "0", "--budget", "600", "--out", tmp_path / "cli"]
    status, out, err = cli(*words, "--fail-if", "collision > 0.001", "--junit", tmp_path / "j.xml")
    assert status == 3
    approve(out, "probability")
    approve(err, "0.001")
    assert 'failures="1"' in (tmp_path / "j.xml").read_text()
    status, out, err = cli(*words, "--json")
    assert status == 0
    assert json.loads(out)["method"] == "mc"
    status, out, err = cli(*words, "--fail-if", "boom > 1")
    assert status == 2
    assert "Traceback" not in err


def test_few_data_leave_more_open_than_many(tmp_path):
    """Speeds that are drawn from a normal distribution: the event is a fast bicycle."""
    random = np.random.default_rng(4)
    widths = []
    for count in (60, 600):
        rows = random.normal(2.2, 0.7, 3 * count)
        rows = rows[(rows > 0.7) & (rows < 3.4)][:count]
        table = tmp_path / f"{count}.csv"
        table.write_text(
            "id,bv_speed\n" + "\n".join(f"{i},{v!r}" for i, v in enumerate(rows.tolist()))
        )
        scenario = bg.load(SCENARIO)
        fit = bg.fit_exposure(
            scenario, table, ignore=["id"], others="uniform", replicates=20, hours=100.0
        )
        found = estimate_risk(
            SCENARIO, ego=DRIVER, exposure=fit.exposure, events=fit, method="mc", precision=0.0,
            budget=1200, out=tmp_path / f"{count}",
        )  # fmt: skip
        p = found.probability("collision")
        assert found.data.low < p.estimate < found.data.high
        widths.append((found.data.high - found.data.low) / p.estimate)
        assert said(found.folder)["data"]["exposures"] == 20
        assert "with exposures of resampled events" in (found.folder / "risk.html").read_text()
    assert widths[1] < 0.6 * widths[0]


def test_a_table_of_other_things_is_refused(tmp_path):
    (tmp_path / "rows.csv").write_text("a,b\n1,2\n")
    with refuses(InputError):
        estimate_risk(
            SCENARIO, exposure="uniform", events=tmp_path / "rows.csv", out=tmp_path / "out"
        )


def test_what_is_in_doubt_is_not_stated(tmp_path):
    """A budget that suffices for a pilot run alone."""
    found = estimate_risk(
        SCENARIO, out=tmp_path / "few", **GIVEN | {"method": "importance", "budget": 300}
    )
    assert found.weighted.doubts
    assert not found.believed
    assert all(one.probability is None for one in found.findings.values())
    assert all(one.probability is None for one in found.by_mode.values())
    assert found.parameters == ()
    page = (found.folder / "risk.html").read_text()
    assert "is not known" in page
    assert "Method mc assumes nothing." in page


def test_too_few_hits_of_strata_are_not_believed(tmp_path):
    found = estimate_risk(
        SCENARIO, out=tmp_path / "few", **GIVEN | {"method": "stratified", "budget": 1500}
    )
    assert 0.0 < found.weighted.hits(found.weighted.there(0.6)) < 30.0
    assert not found.believed


def test_the_check_counts_other_rows(tmp_path):
    """Where auto counts, too."""
    given = GIVEN | {"method": "auto", "budget": 4000, "check": 1000, "precision": 0.5}
    found = estimate_risk(SCENARIO, out=tmp_path / "check", **given)
    assert found.estimated.method == "mc"
    same = np.isin(found.check.Z[:, 0], found.weighted.Z[:, 0])
    assert len(same)
    assert not same.any()


def test_numbers_in_words_also_beyond_all_numbers():
    assert [number(one) for one in (0.0, 0.25, 1.5e-7, 2e5)] == ["0", "0.25", "1.50e-7", "2.00e5"]
    assert number(1e308 * 10.0) == "beyond 1e308"
