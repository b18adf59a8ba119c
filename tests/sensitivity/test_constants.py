"""Constants of the models: each is within its range, reaches what it should, and changes no bit."""

import re
from itertools import pairwise
from types import FunctionType

import numpy as np
import pytest

from bridgegen.assess.conflict import severity
from bridgegen.assess.conflict._conflict_kernels import analyse_rows
from bridgegen.base.physics import GRIP
from bridgegen.drivers._weather_columns import VISUAL_RANGE
from bridgegen.engine.constants import (
    BY_NAME,
    CONSTANTS,
    applying,
    interpreted,
    scaled,
    try_with,
)
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.embedded.chassis._chassis_columns import BRAKE_LAG


def pipeline_of(name, ego, **options):
    scenario = load(name)
    made = Pipeline(scenario, scenario.space(), PipelineOptions(ego=ego, **options))
    made.choose_objective()
    return made


def rows_of(pipeline, n=60):
    space = pipeline.space
    return space.decode(np.random.default_rng(3).random((n, space.n_var))) + 0.0


@pytest.fixture(scope="module")
def cut_out():
    return pipeline_of("cut-out", "route-follower")


@pytest.mark.parametrize("constant", CONSTANTS, ids=lambda one: one.name)
def test_a_range_holds_the_nominal_value_and_has_a_source(constant):
    assert constant.low < constant.value < constant.high
    assert re.search(r"(19|20)\d\d|[Oo]urs|as of", constant.source)
    assert list(BY_NAME).count(constant.name) == 1


@pytest.mark.parametrize(
    ("name", "ego"), [("cut-out", "route-follower"), ("crossroads-s4", "reference"),
                      ("cyclist-right-turn", "route-follower")],
)  # fmt: skip
def test_nominal_constants_give_the_bits_of_the_compiled_analysis(name, ego):
    pipeline = pipeline_of(name, ego)
    X = rows_of(pipeline)
    runner, objective = pipeline.runner, pipeline.objective
    compiled = pipeline.try_all(X)
    rollout = runner.run(X)
    found = try_with(runner, X, X, objective.harm, objective.count,
                     {one.name: one.value for one in CONSTANTS})  # fmt: skip
    # By Python, with a factor of 1 on the odds, which is no change.
    again = interpreted(analyse_rows, {"injury-odds": 1.0})
    from bridgegen.assess.conflict import analysis
    from bridgegen.engine.trials import Trials

    analysis.analyse_by(rollout, again)
    by_python = Trials.of(rollout, *runner.roads_of(X), objective.harm, objective.count)
    assert compiled.harm.any()
    for other in (found, by_python):
        assert np.array_equal(other.harm, compiled.harm)
        assert np.array_equal(other.severity, compiled.severity)
        assert np.array_equal(other.event, compiled.event)
        assert np.array_equal(other.preventable, compiled.preventable)


def reached(function, found):
    """Collect all functions that one calls."""
    found.append(function)
    for name in function.__code__.co_names:
        there = function.__globals__.get(name)
        if isinstance(there, FunctionType) and there not in found:
            reached(there, found)
    return found


@pytest.mark.parametrize("constant", [one for one in CONSTANTS if one.frozen],
                         ids=lambda one: one.name)  # fmt: skip
def test_a_constant_of_the_verdict_reaches_the_analysis_and_nothing_else(constant):
    """Some function sees another value; those of the compiled analysis see the nominal one."""
    analyse = interpreted(analyse_rows, {constant.name: constant.high})
    (run,) = (cell.cell_contents for cell in analyse.__closure__
              if isinstance(cell.cell_contents, FunctionType))  # fmt: skip
    changed = set()
    for function in reached(run, []):
        module = __import__(function.__module__, fromlist=["_"])
        for name in function.__code__.co_names:
            mine, nominal = function.__globals__.get(name), vars(module).get(name)
            if isinstance(nominal, float) and mine != nominal:
                changed.add((name, mine))
            if isinstance(nominal, np.ndarray) and not np.array_equal(mine, nominal):
                changed.add((name, "table"))
    assert len({name for name, _ in changed}) == 1
    assert {value for _, value in changed} <= {constant.high, "table"}


@pytest.mark.thorough
def test_the_careful_drivers_reaction_time_decides_what_is_preventable(cut_out):
    """A slower careful driver avoids less, never more; so fewer contacts count as preventable."""
    X = rows_of(cut_out, 300)
    counts = [
        try_with(cut_out.runner, X, X, "harm", "ego", {"careful-reaction": value}).preventable
        for value in (0.7, 0.75, 1.0, 1.5)
    ]
    assert all((after <= before).all() for before, after in pairwise(counts))
    assert counts[0].sum() > counts[-1].sum() + 5


def test_odds_of_injury_are_odds():
    """Twice the odds of MAIS3+: p / (1 - p) doubles, but for the fading near standstill."""
    pipeline = pipeline_of("cut-in", "route-follower")
    X = rows_of(pipeline, 200)
    runner = pipeline.runner
    before, after = (
        try_with(runner, X, X, "harm", "ego", {"injury-odds": factor}) for factor in (1.0, 2.0)
    )
    fast = before.severity > 0.002
    assert fast.any()
    p, q = before.severity[fast], after.severity[fast]
    assert q / (1 - q) == pytest.approx(2.0 * p / (1 - p), rel=0.01)


def test_friction_of_the_road_scales_what_tyres_give(cut_out):
    program = cut_out.runner.embedded.program
    there = scaled(program, {"road-friction": 0.8 / 0.85})
    given = program.fill({}, 1)[0], there.fill({}, 1)[0]
    column = np.flatnonzero((program.weathers != there.weathers)[0])
    assert given[1][there.weathers[0, column]] == pytest.approx(
        given[0][program.weathers[0, column]] * 0.8 / 0.85
    )
    X = rows_of(cut_out, 5)
    assert cut_out.runner.run(X).friction.max() <= GRIP


def test_sizes_and_brakes_are_those_of_the_bodies(cut_out):
    program = cut_out.runner.embedded.program
    bodies = scaled(program, {"ego-length": 1.1, "ego-width": 0.9, "ego-braking": 0.5,
                              "others-size": 1.2, "others-braking": 0.7}).bodies  # fmt: skip
    assert bodies[0, [0, 1, 5]] == pytest.approx(program.bodies[0, [0, 1, 5]] * [1.1, 0.9, 0.5])
    # The rear overhang grows with the length, too.
    rear = 0.5 * bodies[0, 0] - bodies[0, 2]
    assert rear == pytest.approx(1.1 * (0.5 * program.bodies[0, 0] - program.bodies[0, 2]))
    assert bodies[1:, [0, 1, 5]] == pytest.approx(program.bodies[1:, [0, 1, 5]] * [1.2, 1.2, 0.7])


def test_clear_air_and_brakes_apply_where_there_are_sensors_and_dynamics(cut_out):
    names = {one.name for one in applying(cut_out.runner.embedded.program)}
    assert not names & {"clear-air", "brake-lag"}
    pipeline = pipeline_of("cut-out", "reference", vehicle="single-track")
    program = pipeline.runner.embedded.program
    assert {one.name for one in applying(program)} == {*BY_NAME}
    there = scaled(program, {"clear-air": 0.5, "brake-lag": 2.0})
    assert there.chassis[BRAKE_LAG] == 2.0 * program.chassis[BRAKE_LAG]
    seen, before = there.fill({}, 1)[0], program.fill({}, 1)[0]
    assert seen[there.weathers[0, VISUAL_RANGE]] == pytest.approx(
        0.5 * before[program.weathers[0, VISUAL_RANGE]]
    )


def test_the_nominal_mass_and_friction_are_the_published_ones():
    assert BY_NAME["car-mass"].value == 1500.0
    assert BY_NAME["contact-friction"].value == severity.FRICTION == 0.55
