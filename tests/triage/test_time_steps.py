"""Verdicts at fractions of the time step: what hangs on it is said, and stands behind the rest."""

import numpy as np
import pytest

import bridgegen as bg
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load
from bridgegen.search.triage.record import AtStep, StepCheck
from bridgegen.search.triage.time_steps import step_checks
from bridgegen.search.triage.triage import triage
from bridgegen.search.triage.words import mode_in_words, steps_in_words


def at(steps: int, conflict: str = "contact", *, harmful: bool = True, ok: bool = True) -> AtStep:
    return AtStep(
        steps=steps, ok=ok, harmful=harmful, harm=0.6 * harmful, severity=0.0, conflict=conflict
    )


@pytest.mark.parametrize(
    ("finer", "stable", "words"),
    [
        ([at(2), at(4)], True, ""),
        ([at(2), at(4, "near miss")], False, "contact at 0.05 s, near miss at 0.0125 s"),
        ([at(2, "", harmful=False), at(4)], False, "contact at 0.05 s, no conflict at 0.025 s"),
        (
            [at(2, harmful=False)],
            False,
            "contact at 0.05 s, contact that does not count at 0.025 s",
        ),
        ([at(2, ok=False, harmful=False)], False, "contact at 0.05 s, no result at 0.025 s"),
    ],
)
def test_a_verdict_is_stable_where_each_step_gives_it(finer, stable, words):
    check = StepCheck(evaluation=0, time_step=0.05, at=(at(1), *finer))
    assert check.stable is stable
    assert check.sentence == (words and f"depends on the time step: {words}")


def test_the_kind_of_what_is_no_failure_may_differ():
    first, finer = at(1, "collision course", harmful=False), at(2, "", harmful=False)
    assert StepCheck(evaluation=0, time_step=0.05, at=(first, finer)).stable


def test_findings_that_hang_on_the_step_are_named_and_rank_behind(space, world):
    """Above 8.5 m/s the harm is greater, and gone at an eighth of the step."""
    pipeline = world(
        space,
        lambda v, fix: np.where(v["ego_speed"] >= 8.5, 0.9, np.where(v["ego_speed"] < 6, 0.5, 0.0)),
        label=lambda v: np.where(v["ego_speed"] >= 8.5, "frontal", "rear-end"),
    )
    pipeline.at_step = lambda v, n, harm: np.where((v["ego_speed"] >= 8.5) & (n == 8), 0.1, harm)
    rows = pipeline.rows(400)
    record = triage(pipeline, rows, algorithm="random", seed=0, keep=6).record
    first, second = record.modes
    assert (first.harm, second.harm) == (0.5, 0.9)
    assert record.step_check(first.shown).stable
    assert "depends on the time step: contact at 0.05 s" in mode_in_words(second, record)
    assert "time step" not in mode_in_words(first, record)
    checked = {check.evaluation: check for check in record.step_checks}
    unharmed = [i for i, check in checked.items() if not check.at[0].harmful]
    assert len(unharmed) == 24
    assert not any(rows.critical[unharmed])
    said = steps_in_words(record)
    assert "24 of 24 evaluations without failure keep their verdict" in said
    assert said.endswith("at time steps of 0.05, 0.025, 0.0125, 0.00625 s")


def test_a_finer_step_is_that_of_the_file_with_that_step(tmp_path):
    """A row at a half of the step has the bits of its file, simulated with a half of its step."""
    run = bg.run_search("crossroads-s4", budget=60, keep=1, triage="none", out=tmp_path / "run")
    scenario = load("crossroads-s4")
    pipeline = Pipeline(scenario, scenario.space(), PipelineOptions(ego="route-follower"))
    pipeline.choose_objective()
    (item,) = run.exported()
    rows = np.array([run.rows().X[item.evaluation]])
    (check,) = step_checks(pipeline, rows, np.array([7]), (2, 5))
    assert (check.evaluation, [one.steps for one in check.at]) == (7, [1, 2, 5])
    file = run.folder / "critical" / f"{item.name}.xosc"
    for one in check.at:
        alone = bg.simulate_file(file, time_step=0.05 / one.steps)
        assert one.harm == alone.metrics["harm"]
        assert one.severity == alone.metrics["severity"]


def test_errors_are_of_first_order_in_the_step():
    """The scheme's: of d_min, half the step halves the error against a sixteenth."""
    scenario = load("crossroads-s4")
    space = scenario.space()
    X = space.decode(np.random.default_rng(1).random((60, space.n_var)))
    found = []
    from bridgegen.simulation.choice import SimulatorChoice

    pipeline = Pipeline(scenario, space, PipelineOptions(ego="route-follower", causes=False))
    pipeline.choose_objective()
    at = pipeline.metrics.index("d_min")
    for steps in (1, 2, 16):
        there = pipeline.elsewhere(SimulatorChoice(finer=steps))
        found.append(there.evaluate(X).metrics[:, at])
    coarse, half, fine = found
    ratio = np.abs(coarse - fine).mean() / np.abs(half - fine).mean()
    assert 1.5 < ratio < 3.0


def test_records_without_checks_are_read(tmp_path):
    run = bg.run_search("crossroads-s4", budget=40, keep=1, triage="none", out=tmp_path / "run")
    assert run.triage.step_checks == ()
    assert steps_in_words(run.triage) == ""


def test_what_only_a_finer_step_shows_is_said_without_being_asked(space, world):
    """A run without failures is no plain all-clear where its sample fails at half the step."""
    from bridgegen.cli.terminal.search import _found_lines

    pipeline = world(space, lambda v, fix: np.zeros(len(v["ego_speed"])))
    pipeline.at_step = lambda v, n, harm: np.where((v["ego_speed"] >= 8.0) & (n == 2), 0.8, harm)
    rows = pipeline.rows(400)
    record = triage(pipeline, rows, algorithm="random", seed=0, keep=6).record
    assert record.modes == ()
    assert 0 < record.missed < 24
    kept = f"{24 - record.missed} of 24 evaluations without failure keep their verdict"
    assert f"Time step: {kept} at time steps of" in _found_lines(record)[-1]
    calm = record.model_copy(update={"step_checks": record.step_checks[:0]})
    assert not any(line.startswith("Time step") for line in _found_lines(calm))
