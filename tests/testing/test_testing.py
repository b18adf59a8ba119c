"""The contracts find plug-ins that break them; only who imports them needs pytest."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen.assess.metrics import Metric
from bridgegen.base.plugins import class_of
from bridgegen.search.algorithms import get
from bridgegen.simulation import choice
from bridgegen.simulation.choice import Kind, SimulatorChoice
from bridgegen.testing import (
    AlgorithmContract,
    DriverContract,
    MetricContract,
    SimulatorContract,
    make_rollout,
)

EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "my_algorithm.py"
Random = get("random")


class TestTheExampleOfTheDocumentation(AlgorithmContract):
    algorithm = class_of(f"{EXAMPLE}:Neighbours", "the example")


class DrawsFromTheGlobalGenerator(Random):
    def ask(self):
        U = super().ask()
        return np.random.random(U.shape)  # noqa: NPY002


class Prints(Random):
    def tell(self, U, results):
        print("told")


class LeavesTheCube(Random):
    def ask(self):
        return super().ask() * 1.1


class ResumesElsewhere(Random):
    def state(self):
        return b""

    def restore(self, state):
        for _ in range(9):
            self.ask()


class KeepsWhatItReturns(Random):
    def ask(self):
        self.last = self.last if hasattr(self, "last") else super().ask()
        return self.last


@pytest.mark.parametrize(
    ("algorithm", "test", "given"),
    [
        (DrawsFromTheGlobalGenerator, "test_the_global_generator_is_left_alone", ()),
        (DrawsFromTheGlobalGenerator, "test_one_seed_one_result_whatever_others_draw", ()),
        (LeavesTheCube, "test_rows_stay_in_the_cube_whatever_fails", (3, 1.0)),
        (KeepsWhatItReturns, "test_rows_may_be_changed_by_who_asked", ()),
    ],
)
def test_an_algorithm_that_breaks_a_rule_is_found_out(algorithm, test, given):
    contract = AlgorithmContract()
    contract.algorithm = algorithm
    with pytest.raises(AssertionError):
        getattr(contract, test)(*given)


def test_an_algorithm_that_cannot_resume_is_found_out(tmp_path):
    contract = AlgorithmContract()
    contract.algorithm = ResumesElsewhere
    with pytest.raises(AssertionError):
        contract.test_resumed_anywhere_the_result_is_the_same([1], tmp_path)


def test_an_algorithm_that_prints_is_found_out(capfd):
    contract = AlgorithmContract()
    contract.algorithm = Prints
    with pytest.raises(AssertionError):
        contract.test_it_says_nothing(capfd)


def largest_speed(rollout):
    steps = np.arange(rollout.v.shape[2]) < rollout.n_steps[:, None]
    return np.where(steps, rollout.v[:, 0], 0.0).max(axis=1)


def speed(compute):
    nan = lambda r: np.where(r.status == 0, compute(r), np.nan)  # noqa: E731
    return Metric("speed", "m/s", "of the ego", "larger", 0.0, nan)


class TestSpeed(MetricContract):
    metric = speed(largest_speed)


@pytest.mark.parametrize(
    ("metric", "test"),
    [
        (speed(lambda r: r.v[:, 0].max(axis=1)), "test_padding_is_not_read"),
        (speed(lambda r: largest_speed(r) / r.v.shape[2]), "test_more_padding_changes_nothing"),
        (speed(lambda r: 0.0), "test_it_finds_something_in_the_scenes_of_these_tests"),
        (
            speed(lambda r: largest_speed(r) - largest_speed(r).mean()),
            "test_a_row_does_not_depend_on_its_batch",
        ),
        (
            replace(speed(largest_speed), compute=largest_speed),
            "test_failed_scenarios_and_no_others_are_nan",
        ),
        (speed(lambda r: r.x[:, 0, 0]), "test_turning_and_moving_the_scene_changes_nothing"),
        (speed(lambda r: r.v[:, 1:, 0].max(axis=1)), "test_an_absent_entity_does_not_count"),
    ],
)
def test_a_metric_that_breaks_a_rule_is_found_out(metric, test):
    contract = MetricContract()
    contract.metric = metric
    with pytest.raises(AssertionError):
        getattr(contract, test)()


def test_a_metric_that_depends_on_the_order_of_the_others_is_found_out():
    contract = MetricContract()
    contract.metric = speed(lambda r: r.v[:, 1, 0])
    with pytest.raises(AssertionError):
        contract.test_the_order_of_the_others_does_not_matter(0)


def test_a_rollout_is_made_by_hand():
    assert largest_speed(make_rollout(v=[[3.0, 5.0, 4.0], [9.0, 9.0, 9.0]])) == [5.0]


class Twin:
    """The embedded simulator, but for what a subclass breaks."""

    def __init__(self, embedded):
        self.embedded = embedded

    def __getattr__(self, name):
        return getattr(self.embedded, name)

    def run(self, roads, rows, values, **given):
        return self.broken(self.embedded.run(roads, rows, values, **given))


class ByBatch(Twin):
    def broken(self, rollout):
        return replace(rollout, y=rollout.y + 1e-9 * len(rollout.y))


class Slow(Twin):
    def broken(self, rollout):
        return replace(rollout, v=0.99 * rollout.v)


@pytest.mark.parametrize(
    ("twin", "test", "given"),
    [
        (ByBatch, "test_a_row_is_the_same_to_the_last_bit_whatever_its_batch", ("reference",)),
        (Slow, "test_constant_speeds", ()),
    ],
)
def test_a_simulator_that_breaks_a_rule_is_found_out(twin, test, given, monkeypatch):
    kind = Kind("twin", "The embedded one again, but worse.", lambda embedded, *_: twin(embedded))
    monkeypatch.setitem(choice.SIMULATORS, "twin", kind)
    contract = SimulatorContract()
    contract.simulator = SimulatorChoice("twin")
    with pytest.raises(AssertionError):
        getattr(contract, test)(*given)


def test_a_driver_that_breaks_a_rule_is_found_out_and_what_it_was_not_checked_for():
    contract = DriverContract()
    contract.driver = f"{Path(__file__).parents[1] / 'ego' / 'drivers.py'}:Remembers"
    contract.scenarios = ("cut-in",)
    with refuses(AssertionError):
        contract.test_it_keeps_a_rule("the same row again gives the same motion")
    with pytest.raises(pytest.skip.Exception):
        contract.test_it_keeps_a_rule("the order of the rows does not matter")


def python(code):
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)


@pytest.mark.parametrize("name", ["pytest", "hypothesis"])
def test_what_is_missing_is_said_in_one_sentence(name):
    done = python(f"import sys; sys.modules[{name!r}] = None; import bridgegen.testing")
    approve(done.stderr.splitlines()[-1], "ImportError", name)


def test_neither_bridgegen_nor_its_command_line_needs_pytest(tmp_path):
    code = """
import sys
sys.modules["pytest"] = sys.modules["hypothesis"] = None
import bridgegen
from bridgegen.cli import main
sys.argv = ["bridgegen", "list", "algorithms"]
main()
"""
    done = python(code)
    assert done.returncode == 0, done.stderr
    assert "surrogate" in done.stdout
