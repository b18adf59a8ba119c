"""A user's scenario file and its distribution: searched, resumed, handed over, refused."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy import stats
from tests.approval import approve, refuses

import bridgegen as bg
from bridgegen.base.errors import BridgeGenError, InputError, Interrupted, StorageError
from bridgegen.cli import main
from bridgegen.jobs.search import SearchCallbacks
from bridgegen.jobs.search.validate import validate_file
from bridgegen.results.store import Store

from .braking import (
    deterministic,
    distribution_text,
    limits,
    scenario_text,
    stochastic,
    value_sets,
    write_pair,
)

pytestmark = pytest.mark.thorough


def columns(folder: Path) -> dict[str, np.ndarray]:
    with Store.open(folder) as store:
        return dict(zip(store.parameters, store.read().X.T, strict=True))


def rows_of(folder: Path):
    with Store.open(folder) as store:
        return store.read()


def recorded(folder: Path, evaluation: int) -> dict[str, float]:
    with Store.open(folder) as store:
        return dict(zip(store.metrics, store.read().metrics[evaluation].tolist(), strict=True))


def same(a: Path, b: Path) -> bool:
    one, other = rows_of(a), rows_of(b)
    return all(
        np.array_equal(getattr(one, name), getattr(other, name), equal_nan=True)
        for name in ("id", "U", "X", "metrics", "F", "status", "critical")
    )


def search(folder: Path, body: str | None = None, text: str | None = None, **arguments):
    scenario, ranges = write_pair(folder, *([body] if body else []), text=text)
    arguments = {"algorithm": "random", "keep": 3, "out": folder / "run"} | arguments
    return bg.run_search(scenario, distribution=ranges, **arguments)


CLOSE = stochastic(
    ("Gap", f"<UniformDistribution>{limits(5.2, 9)}</UniformDistribution>"), seed=' randomSeed="7"'
)


@pytest.mark.parametrize(("ego", "body"), [(None, None), ("reference", CLOSE)])
def test_what_is_found_is_handed_over_as_the_user_s_own_file(tmp_path, ego, body):
    run = search(tmp_path, body, ego=ego, objective={"paper": None})
    # The budget and the seed are the distribution's, unless the user says otherwise.
    assert (run.settings.budget, run.settings.seed) == (60, 7)
    assert run.settings.ego == (ego or "storyboard")
    rows = rows_of(run.folder)
    assert len(rows) == 60
    assert run.report.stat().st_size > 10_000
    assert bool(run.scenarios) == (run.verdict == "fails") == (ego != "reference")
    for path in run.scenarios:
        facts = json.loads(path.with_suffix(".json").read_text("utf-8"))
        result = bg.simulate_file(path)
        kept = recorded(run.folder, facts["row"])
        assert {name: result.metrics[name] for name in kept} == kept
        assert result.driver == run.settings.ego
        found = {name: one["value"] for name, one in facts["parameters"].items()}
        assert result.parameters == found
        assert found["BrakeTime"] == 2.0  # not in the distribution: as the file declares it
        roads = tmp_path / "roads" / "straight.xodr"
        assert path.with_suffix(".xodr").read_bytes() == roads.read_bytes()
        assert not path.with_suffix(".owl").exists()  # the ontology cannot say all of this file


def test_random_search_draws_from_the_distribution(tmp_path):
    run = search(tmp_path, budget=3000, keep=0)
    drawn = columns(run.folder)
    normal = stats.truncnorm(-3.0, 11.0 / 3.0, 14.0, 3.0)
    assert stats.kstest(drawn["EgoSpeed"], normal.cdf).pvalue > 0.01
    assert stats.kstest(drawn["Gap"], stats.uniform(10.0, 50.0).cdf).pvalue > 0.01
    assert set(drawn["Deceleration"]) == {3.0, 8.0}
    slow = int((drawn["Deceleration"] == 3.0).sum())
    assert stats.binomtest(slow, 3000, 0.75).pvalue > 0.01


def test_interrupted_and_resumed_is_as_if_undisturbed(tmp_path):
    whole = search(tmp_path / "a", algorithm="pso", budget=240, keep=2)

    def stop(progress) -> None:
        if progress.evaluations >= 80:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted):
        search(
            tmp_path / "b",
            algorithm="pso",
            budget=240,
            keep=2,
            callbacks=SearchCallbacks(batch=stop),
        )
    assert 80 <= len(rows_of(tmp_path / "b" / "run")) < 240
    resumed = bg.resume(tmp_path / "b" / "run")
    assert same(whole.folder, resumed.folder)
    for a, b in zip(whole.scenarios, resumed.scenarios, strict=True):
        assert a.read_bytes() == b.read_bytes()


@pytest.mark.parametrize("name", ["brake.xosc", "ranges.xosc", "roads/straight.xodr"])
def test_a_changed_file_is_refused_on_resume(tmp_path, name):
    run = search(tmp_path, budget=30)
    path = tmp_path / name
    text = path.read_text("utf-8")
    changed = {
        "brake.xosc": ('value="30"', 'value="31"'),
        "ranges.xosc": ('variance="9"', 'variance="8"'),
        "roads/straight.xodr": ('name="main"', 'name="other"'),
    }[name]
    assert changed[0] in text
    path.write_text(text.replace(*changed), "utf-8")
    with refuses(StorageError):
        bg.resume(run.folder)
    path.write_text(text, "utf-8")
    bg.resume(run.folder)


def test_the_recorded_command_makes_the_same_run(tmp_path, monkeypatch):
    run = search(tmp_path, budget=40)
    command = run.settings.command(tmp_path / "again").split()
    monkeypatch.setattr(sys, "argv", command)
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code in (0, None)
    assert same(run.folder, tmp_path / "again")


def test_value_sets_are_taken_whole(tmp_path):
    body = value_sets({"EgoSpeed": 10, "Gap": 20, "BrakeTime": 1}, {"EgoSpeed": 20, "Gap": 50})
    run = search(tmp_path, body, budget=50)
    drawn = columns(run.folder)
    rows = set(zip(drawn["EgoSpeed"], drawn["Gap"], drawn["BrakeTime"], strict=True))
    assert rows == {(10.0, 20.0, 1.0), (20.0, 50.0, 2.0)}  # what a set leaves out stays as declared
    assert rows_of(run.folder).U.shape == (2, 1)  # a third evaluation would be one of these again


def test_ranges_have_steps_and_sets_their_values(tmp_path):
    body = deterministic(
        ("Gap", f'<DistributionRange stepWidth="0.1">{limits(20, 20.35)}</DistributionRange>'),
        ("EgoSpeed", '<DistributionSet><Element value="12"/><Element value="9.5"/>'
         "</DistributionSet>"),
    )  # fmt: skip
    drawn = columns(search(tmp_path, body, budget=500, keep=0).folder)
    assert len(drawn["Gap"]) == 8  # 4 steps times 2 values
    assert sorted(set(drawn["Gap"])) == pytest.approx([20.0, 20.1, 20.2, 20.3])
    assert set(drawn["EgoSpeed"]) == {9.5, 12.0}


def test_whole_numbers_stay_whole(tmp_path):
    whole = scenario_text().replace('"EgoSpeed" parameterType="double"',
                                    '"EgoSpeed" parameterType="unsignedShort"')  # fmt: skip
    body = stochastic(
        ("EgoSpeed", f"<UniformDistribution>{limits(3.5, 6.2)}</UniformDistribution>")
    )
    run = search(tmp_path, body, whole, budget=40)
    assert set(columns(run.folder)["EgoSpeed"]) == {4.0, 5.0, 6.0}
    assert 'parameterType="unsignedShort" value="' in run.scenarios[0].read_text("utf-8")


def test_a_file_of_ours_keeps_its_units_its_formulas_and_its_ontology(tmp_path):
    first = bg.run_search(
        "crossroads-s4", budget=60, keep=1, triage="short", out=tmp_path / "first", seed=1
    )
    scenario = first.scenarios[0]
    ranges = tmp_path / "ranges.xosc"
    body = stochastic(
        ("fog_density", f"<UniformDistribution>{limits(0, 10)}</UniformDistribution>"),
        ("bv_speed", f"<UniformDistribution>{limits(1, 3)}</UniformDistribution>"),
    )
    ranges.write_text(distribution_text(body, "first/critical/0001.xosc"), "utf-8")
    run = bg.run_search(
        scenario, distribution=ranges, budget=80, keep=2, triage="short", out=tmp_path / "run",
    )  # fmt: skip
    drawn = columns(run.folder)
    assert np.ptp(drawn["fog_density"]) > 5.0
    assert drawn["fog_distance"] == pytest.approx(100.0 - drawn["fog_density"])
    assert run.scenarios
    for path in run.scenarios:
        assert path.with_suffix(".owl").exists()
        facts = json.loads(path.with_suffix(".json").read_text("utf-8"))
        assert facts["parameters"]["bv_speed"]["unit"] == "m/s"
        kept, found = recorded(run.folder, facts["row"]), bg.simulate_file(path).metrics
        assert {name: found[name] for name in kept} == kept


def uniform(name: str, low: float = 1.0, high: float = 2.0) -> str:
    return stochastic((name, f"<UniformDistribution>{limits(low, high)}</UniformDistribution>"))


REFUSED = {
    "declares no parameter 'EgoSped'; did you mean 'EgoSpeed'?": uniform("EgoSped"),
    "parameter RoadId is a string; it can take the values of a set, but not of a range": (
        uniform("RoadId")
    ),
    "low <= high must hold for a range, got 3 and 2": uniform("Gap", 3, 2),
    "UserDefinedDistribution in StochasticDistribution is not supported": stochastic(
        ("Gap", '<UserDefinedDistribution type="mine">1</UserDefinedDistribution>')
    ),
    "parameter Gap must have one distribution, got two": stochastic(
        ("Gap", f"<UniformDistribution>{limits(1, 2)}</UniformDistribution>"),
        ("Gap", '<PoissonDistribution expectedValue="20"/>'),
    ),
    "parameter StopAfter is a whole number (int), and a NormalDistribution gives others": (
        stochastic(("StopAfter", '<NormalDistribution expectedValue="9" variance="1"/>'))
    ),
    "stepWidth must be above 0, got 0": deterministic(
        ("Gap", f'<DistributionRange stepWidth="0">{limits(1, 2)}</DistributionRange>')
    ),
    "a range may have 100000 steps, got 1e+09": deterministic(
        ("Gap", f'<DistributionRange stepWidth="1e-9">{limits(1, 2)}</DistributionRange>')
    ),
    "must be of type double, got 'far'": deterministic(
        ("Gap", '<DistributionSet><Element value="far"/></DistributionSet>')
    ),
    "upperLimit of Range must be of type double, got '${1+1}'": stochastic(
        ("Gap", '<UniformDistribution><Range lowerLimit="1" upperLimit="${1+1}"/>'
         "</UniformDistribution>")
    ),
    "randomSeed must be a whole number, 0 to 4294967295, got 1.5": stochastic(
        ("Gap", f"<UniformDistribution>{limits(1, 2)}</UniformDistribution>"),
        seed=' randomSeed="1.5"',
    ),
    "nothing to search, every parameter is fixed": uniform("Gap", 2, 2),
    "1 <= budget <= 10000000 must hold, got 0": stochastic(
        ("Gap", f"<UniformDistribution>{limits(1, 2)}</UniformDistribution>"), runs=0
    ),
}  # fmt: skip


@pytest.mark.parametrize("message", REFUSED)
def test_what_cannot_be_searched_is_refused_with_the_reason(tmp_path, message):
    with pytest.raises(BridgeGenError) as caught:
        search(tmp_path, REFUSED[message])
    assert message in str(caught.value)
    assert not (tmp_path / "run").exists()


CONSTRAINED = scenario_text().replace(
    '<ParameterDeclaration name="Gap" parameterType="double" value="30"/>',
    '<ParameterDeclaration name="Gap" parameterType="double" value="30"><ConstraintGroup>'
    '<ValueConstraint rule="lessOrEqual" value="35"/></ConstraintGroup><ConstraintGroup>'
    '<ValueConstraint rule="greaterOrEqual" value="50"/></ConstraintGroup></ParameterDeclaration>',
)


def test_a_distribution_keeps_the_declared_constraints(tmp_path):
    search(tmp_path / "a", uniform("Gap", 20, 35), CONSTRAINED, budget=5)
    search(tmp_path / "b", uniform("Gap", 50, 60), CONSTRAINED, budget=5)
    with refuses(InputError, "40", "35"):
        search(tmp_path / "c", uniform("Gap", 20, 40), CONSTRAINED, budget=5)
    with refuses(InputError, "20", "60"):
        search(tmp_path / "d", uniform("Gap", 20, 60), CONSTRAINED, budget=5)


def test_a_constraint_on_two_parameters_holds_in_every_evaluation(tmp_path):
    text = scenario_text().replace(
        '<ParameterDeclaration name="Gap" parameterType="double" value="30"/>',
        '<ParameterDeclaration name="Gap" parameterType="double" value="30"><ConstraintGroup>'
        '<ValueConstraint rule="greaterOrEqual" value="${0.5 * $EgoSpeed + 20}"/>'
        '<ValueConstraint rule="greaterThan" value="0"/></ConstraintGroup></ParameterDeclaration>',
    )
    both = stochastic(
        ("Gap", f"<UniformDistribution>{limits(20, 60)}</UniformDistribution>"),
        ("EgoSpeed", f"<UniformDistribution>{limits(10, 30)}</UniformDistribution>"),
    )
    search(tmp_path, both, text, budget=50)
    found = columns(tmp_path / "run")
    assert (found["Gap"] >= 0.5 * found["EgoSpeed"] + 20.0 - 1e-9).all()
    assert found["EgoSpeed"].max() > 25.0


@pytest.mark.parametrize("many", [False, True])
def test_a_text_with_one_value_is_part_of_the_scenario(tmp_path, many):
    """By itself, or in sets of values: it is in what is exported, and no axis of the search."""
    text = scenario_text().replace(
        "</ParameterDeclarations>",
        '<ParameterDeclaration name="Case" parameterType="string" value="none"/>'
        '<ParameterDeclaration name="Wet" parameterType="boolean" value="false"/>'
        "</ParameterDeclarations>",
    )

    def one_of(*values):
        return "".join(f'<Element value="{value}"/>' for value in values)

    rows = ("Case", "CCR-7"), ("RoadId", "1"), ("Wet", "true"), ("Gap", 20, 30)
    body = deterministic(
        *((name, f"<DistributionSet>{one_of(*values)}</DistributionSet>") for name, *values in rows)
    )
    if many:
        body = value_sets(*({"Gap": gap, "Case": "CCR-7", "Wet": "true"} for gap in (20, 30)))
    search(tmp_path, body, text, budget=4)
    found = columns(tmp_path / "run")
    assert set(found["Gap"]) <= {20.0, 30.0}
    assert "Case" not in found
    exported = (tmp_path / "run" / "critical" / "0001.xosc").read_text()
    assert 'name="Case" parameterType="string" value="CCR-7"' in exported
    assert 'name="Wet" parameterType="boolean" value="true"' in exported


def test_a_distribution_of_another_scenario_is_refused(tmp_path):
    scenario, ranges = write_pair(tmp_path)
    ranges.write_text(distribution_text(uniform("Gap"), "../other.xosc"), "utf-8")
    with refuses(InputError):
        bg.run_search(scenario, distribution=ranges, triage="short", out=tmp_path / "run")


def test_a_map_of_the_search_is_refused(tmp_path):
    with refuses(InputError):
        search(tmp_path, road_map=tmp_path / "roads" / "straight.xodr")


def test_a_distribution_is_for_a_scenario_file(tmp_path):
    _, ranges = write_pair(tmp_path)
    with refuses(InputError):
        bg.run_search("crossroads-s4", distribution=ranges, triage="short", out=tmp_path / "run")


def command(monkeypatch, capsys, *words) -> str:
    monkeypatch.setattr(sys, "argv", ["bridgegen", *map(str, words)])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    return capsys.readouterr().err


def test_without_a_distribution_the_command_says_what_could_vary(tmp_path, monkeypatch, capsys):
    scenario, _ = write_pair(tmp_path)
    said = command(monkeypatch, capsys, "search", scenario)
    approve(said, "EgoSpeed", "BrakeTime", "StopAfter", "RoadId")


@pytest.mark.parametrize("what", ["simulate", "search"])
def test_a_distribution_alone_is_refused_with_what_to_do(tmp_path, monkeypatch, capsys, what):
    _, ranges = write_pair(tmp_path)
    said = command(monkeypatch, capsys, what, ranges)
    approve(said, "--distribution", "brake.xosc")


def test_a_scenario_is_no_distribution(tmp_path):
    scenario, _ = write_pair(tmp_path)
    with refuses(InputError, "ParameterValueDistribution"):
        bg.run_search(scenario, distribution=scenario, triage="short", out=tmp_path / "run")


def test_a_distribution_is_validated_with_its_scenario(tmp_path):
    _, ranges = write_pair(tmp_path)
    assert validate_file(ranges) == []
    _, ranges = write_pair(tmp_path / "b", uniform("Gip"))
    (problem,) = validate_file(ranges)
    approve(problem, ranges, "Gip")


@pytest.mark.checkers
def test_strangers_accept_what_is_handed_over(tmp_path, checkers):
    run = search(tmp_path)
    assert all(report.clean for report in checkers.qc_openscenario(*run.scenarios))
