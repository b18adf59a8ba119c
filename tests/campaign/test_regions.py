import json
import sqlite3

import numpy as np
import pytest
from tests.approval import approve, refuses

import bridgegen as bg
from bridgegen.base.errors import InputError, ScenarioError, StorageError
from bridgegen.jobs.search.coverage import coverage_of
from bridgegen.jobs.search.regions import regions_of
from bridgegen.results.store import Store
from bridgegen.scenario.language.box_sampling import in_box
from bridgegen.scenario.ontology.files import load
from bridgegen.scenario.ontology.vocabulary import LABEL

from .braking import limits, stochastic, write_pair

pytestmark = pytest.mark.thorough


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("runs") / "s3"
    bg.run_search(
        "crossroads-s3", algorithm="random", budget=400, seed=1, ego="route-follower", keep=0,
        objective="paper",
        causes=False, deliver=False, out=place,
    )  # fmt: skip
    return place


@pytest.fixture(scope="module")
def found(folder):
    return regions_of(folder, samples=100)


def copied(folder, place, **changes):
    """The run elsewhere, with other settings or without some of its rows."""
    place.mkdir()
    (place / "run.sqlite").write_bytes((folder / "run.sqlite").read_bytes())
    with sqlite3.connect(place / "run.sqlite") as connection:
        for statement in changes.pop("sql", ()):
            connection.execute(statement)
        if changes:
            sql = "SELECT value FROM run WHERE key = 'settings'"
            settings = json.loads(connection.execute(sql).fetchone()[0])
            connection.execute(
                "UPDATE run SET value = ? WHERE key = 'settings'",
                [json.dumps(settings | changes)],
            )
    return place


def test_regions_hold_for_scenarios_found_by_trying(folder, found):
    """Independent rows of the whole space, those outside a region thrown away."""
    from bridgegen.jobs.search.restored import pipeline_of

    assert len(found.found.confirmed) >= 2
    pipeline = pipeline_of(bg.Run(folder), "regions")
    space = pipeline.space
    X = space.decode(np.random.default_rng(99).random((2000, space.n_var)))
    result = pipeline.evaluate(X)
    for one in found.found.regions:
        inside = in_box(space, X, one.box.low, one.box.high)
        assert inside.mean() == pytest.approx(one.space_share, abs=0.03)
        share = result.critical[inside].mean()
        spread = np.sqrt(share * (1.0 - share) / inside.sum()) + 0.01
        low, high = one.fresh.interval
        assert low - 2.5 * spread < share < high + 2.5 * spread
    anywhere = result.critical.mean()
    assert all(one.fresh.share > anywhere + 0.1 for one in found.found.confirmed)


def test_the_files_say_what_was_found(folder, found):
    record = json.loads((folder / "regions.json").read_text("utf-8"))
    assert record == json.loads(json.dumps(found.record))
    assert (record["evaluations"], record["finished"], record["seed"]) == (400, True, 1)
    with Store.open(folder) as store:
        frame = store.frame()
    assert record["critical"] == int(frame.critical.sum())
    held = np.zeros(len(frame), bool)
    for one in record["regions"]:
        inside = np.ones(len(frame), bool)
        for name, edges in one["box"].items():
            inside &= frame[name].between(edges["low"], edges["high"])
        counts = (int(inside.sum()), int((inside & frame.critical).sum()))
        assert counts == (one["search"]["rows"], one["search"]["critical"])
        assert [p for p in record["parameters"] if p["name"] in one["named"]]
        held |= inside & one["confirmed"]
    assert record["critical_held"] == int((held & frame.critical).sum())
    owl = load(folder / "regions.owl")
    labels = [quad.object.value for quad in owl.quads if quad.predicate == LABEL]
    classes = sorted(label for label in labels if label.startswith("critical region"))
    confirmed = range(1, len(found.found.confirmed) + 1)
    assert classes == [f"critical region {k} of crossroads-s3" for k in confirmed]
    assert found.files == (folder / "regions.json", folder / "regions.owl")


def test_one_seed_gives_one_result_however_many_threads(folder, found, tmp_path):
    place = copied(folder, tmp_path / "run")
    again = regions_of(place, samples=100, seed=1, workers=1)
    assert again.record | {"run": ""} == found.record | {"run": ""}
    for name in ("regions.json", "regions.owl"):
        mine, theirs = ((one / name).read_bytes() for one in (place, folder))
        assert mine == theirs.replace(bytes(folder), bytes(place))
    other = regions_of(place, samples=100, seed=2)
    assert other.record["regions"] != found.record["regions"]


def test_a_run_that_is_not_finished_has_regions_of_what_is_there(folder, tmp_path, cli):
    sql = ["DELETE FROM run WHERE key = 'finished'", "DELETE FROM evaluations WHERE id >= 200"]
    place = copied(folder, tmp_path / "run", sql=sql)
    code, out, _ = cli("analyse", "regions", place, "--samples", 50)
    assert code == 0
    approve(out, "200")
    assert json.loads((place / "regions.json").read_text("utf-8"))["rows"] == 200


def test_the_command_says_what_holds_and_what_does_not(folder, found, cli, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    code, out, err = cli("analyse", "regions", folder, "--samples", 100)
    assert (code, err.strip()) == (0, "")
    approve(out, "50")
    table, _, rest = out.partition("Not confirmed:")
    for one in found.found.confirmed:
        assert f"{one.fresh.critical} of 100" in table
        assert f"{one.search.critical} of {one.search.rows}" in table
    refuted = [one for one in found.found.regions if not one.confirmed]
    for one in refuted:
        assert f"{one.fresh.critical} of 100" in rest
    held = f"{found.found.critical_held} of the run's {found.found.critical} critical scenarios"
    assert held in out
    assert f"{len(found.found.regions) * 100} fresh scenarios, seed 1" in out
    code, out, _ = cli("analyse", "regions", folder, "--samples", 100, "--json")
    assert (code, json.loads(out)) == (0, json.loads(json.dumps(found.record)))


def test_a_report_that_is_there_is_written_again_with_the_regions(folder, tmp_path):
    place = copied(folder, tmp_path / "run")
    assert "report.html" not in {file.name for file in regions_of(place, samples=20).files}
    (place / "report.html").write_text("an old one")
    made = regions_of(place, samples=20)
    assert made.files[-1] == place / "report.html"
    text = made.files[-1].read_text()
    assert json.dumps(made.record["regions"][0]["rule"])[1:-1] in text
    assert f'"view":"bridgegen open {place}"' in text


def test_nothing_that_holds_is_said_and_leaves_no_class(folder, tmp_path, cli):
    place = copied(folder, tmp_path / "run")
    (place / "regions.owl").write_text("of an earlier time", "utf-8")
    code, out, _ = cli("analyse", "regions", place, "--samples", 3)  # three rows confirm nothing
    assert code == 0
    approve(out, "50", "confirmed")
    assert not (place / "regions.owl").exists()
    assert json.loads((place / "regions.json").read_text("utf-8"))["critical_held"] == 0


def test_every_mistake_is_one_clear_error(folder, tmp_path, cli):
    def refused(*words):
        code, _, err = cli("analyse", "regions", *words)
        assert (code, "Traceback" in err) == (2, False)
        return err

    assert "nowhere" in refused(tmp_path / "nowhere")
    assert "1 <= samples" in refused(folder, "--samples", 0)
    approve(refused(folder, "--at-least", 2), "at_least")
    assert "0 <= seed" in refused(folder, "--seed", -1)
    approve(refused(folder, "--ego", "fsm"), "--ego", "fsm")
    calm = copied(folder, tmp_path / "calm", sql=["UPDATE evaluations SET critical = 0"])
    approve(refused(calm), "400")
    empty = copied(folder, tmp_path / "empty", sql=["DELETE FROM evaluations"])
    approve(refused(empty), "evaluations")
    mine = copied(folder, tmp_path / "mine", ego="mine.py:Driver")
    approve(refused(mine), mine, "--ego")
    other = copied(folder, tmp_path / "other", fingerprint="0" * 64)
    approve(refused(other), "what")
    assert not (calm / "regions.json").exists()


def test_a_folder_that_cannot_be_written_is_said(folder, tmp_path):
    place = copied(folder, tmp_path / "run")
    (place / "regions.json").mkdir()
    with refuses(StorageError, "regions.json"):
        regions_of(place, samples=10)


def test_where_one_cause_counts_it_counts_here_too(tmp_path):
    """Harm that planning would have avoided: all other harm is as good as none."""
    place = tmp_path / "run"
    run = bg.run_search(
        "crossroads-s2", algorithm="random", budget=150, seed=2, objective="paper",
        ego="route-follower", keep=0, cause="planning", deliver=False, out=place,
    )  # fmt: skip
    counted = int(run.frame().critical.sum())
    found = regions_of(place, samples=60, at_least=0.3)
    assert found.record["cause"] == "planning"
    assert found.found.critical == counted
    assert found.found.confirmed


def test_of_a_scenario_file_s_choices_the_values_are_said(tmp_path, cli):
    """A lead vehicle brakes: the harder, the later it may begin and still do harm."""
    body = stochastic(
        ("Gap", f"<UniformDistribution>{limits(5.2, 60)}</UniformDistribution>"),
        ("BrakeTime", f"<UniformDistribution>{limits(1, 14)}</UniformDistribution>"),
        ("Deceleration", '<ProbabilityDistributionSet><Element value="0.5" weight="1"/>'
         '<Element value="3" weight="3"/><Element value="8" weight="1"/>'
         "</ProbabilityDistributionSet>"),
    )  # fmt: skip
    scenario, ranges = write_pair(tmp_path, body)
    place = tmp_path / "run"
    bg.run_search(
        scenario, distribution=ranges, algorithm="random", budget=500, keep=0, deliver=False,
        out=place,
    )  # fmt: skip
    code, out, _ = cli("analyse", "regions", place)
    assert code == 0
    record = json.loads((place / "regions.json").read_text("utf-8"))
    edges = {
        edge
        for one in record["regions"]
        if "Deceleration" in one["named"]
        for edge in one["box"]["Deceleration"].values()
    }
    assert edges
    assert edges <= {0.5, 3.0, 8.0}
    confirmed = [one for one in record["regions"] if one["confirmed"]]
    assert confirmed[0]["box"]["BrakeTime"]["high"] < 12.0  # when the scenario ends
    assert record["critical_held"] > 0.8 * record["critical"]
    assert f"{len(confirmed)} of the confirmed regions cannot be stated as classes" in out
    assert not (place / "regions.owl").exists()


def test_python_says_where_a_search_is_missing(tmp_path):
    with pytest.raises((InputError, StorageError)):
        regions_of(tmp_path)


EXPOSURE = """\
exposure_of: crossroads-s3
exposure:
  source: Made for a test.
  others: uniform
  parameters:
    ego_speed: {distribution: normal, mean: 7, deviation: 0.1}
"""


def test_with_an_exposure_it_says_how_likely_it_is_to_meet_them(folder, tmp_path, cli):
    place = copied(folder, tmp_path / "run")
    plain = regions_of(place, samples=50)
    assert "exposure" not in plain.record
    even = regions_of(place, samples=50, exposure="uniform")
    rules = [[one["rule"] for one in each.record["regions"]] for each in (plain, even)]
    assert rules[0] == rules[1]
    for told, one in zip(even.record["regions"], even.found.regions, strict=True):
        low, high = told["exposure"]["interval"]
        assert low <= told["exposure"]["share"] <= high
        assert told["exposure"]["share"] == pytest.approx(one.space_share, abs=0.06)
    (tmp_path / "road.yaml").write_text(EXPOSURE)
    code, out, err = cli(
        "analyse", "regions", place, "--samples", 50, "--exposure", tmp_path / "road.yaml"
    )
    assert code == 0, err
    approve(" ".join(out.split()), "source")
    record = json.loads((place / "regions.json").read_text("utf-8"))
    exposure = bg.read_exposure(tmp_path / "road.yaml")
    X, index = exposure.sample(20_000, 9).X, exposure.space.index
    for one in record["regions"]:
        inside = np.ones(len(X), bool)
        for name, ends in one["box"].items():
            inside &= (X[:, index(name)] >= ends["low"]) & (X[:, index(name)] <= ends["high"])
        assert one["exposure"]["share"] == pytest.approx(inside.mean(), abs=0.015)


def test_an_exposure_of_another_scenario_is_refused(folder, tmp_path):
    (tmp_path / "road.yaml").write_text(EXPOSURE.replace("crossroads-s3", "cut-in"))
    with refuses(ScenarioError, "crossroads-s3", "cut-in"):
        regions_of(folder, exposure=tmp_path / "road.yaml")
    with refuses(ScenarioError, "crossroads-s3", "cut-in"):
        coverage_of(folder, exposure=tmp_path / "road.yaml")
