from collections.abc import Callable, Iterable
from pathlib import Path

import pytest

from bridgegen.scenario.language.expression import parse
from bridgegen.scenario.language.parameters import Axis, Bound, Derived, Parameter
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.language.roads import usual
from bridgegen.scenario.language.scenario import LogicalScenario, ObjectiveSpec, Term
from bridgegen.scenario.language.story import Participant, Story, Waypoint

BuildScenario = Callable[..., LogicalScenario]


def build_scenario(
    parameters: Iterable[Parameter] = (),
    bounds: Iterable[tuple[str, str | None, str | None]] = (),
    derived: Iterable[tuple[str, str]] = (),
    axes: tuple[Axis, ...] = (Axis.EXTENSION,),
) -> LogicalScenario:
    """A scenario around some parameters, made without a file (so without a file's checks)."""
    return LogicalScenario(
        name="made",
        title="Made",
        description="",
        source="",
        place="",
        duration=20.0,
        time_step=0.05,
        roads=usual("crossroads"),
        story=Story(
            (
                Participant(
                    "ego", "car", Waypoint.at_point("P1", 40.0), Waypoint.at_point("P6", 40.0), 6.9
                ),
            )
        ),
        driver="route-follower",
        effects=(),
        axes=axes,
        parameters={one.name: one for one in parameters},
        bounds=tuple(
            Bound(target, lo and parse(lo), hi and parse(hi), "a reason", "a source")
            for target, lo, hi in bounds
        ),
        derived=tuple(
            Derived(name, Axis.EXTENSION, "1", parse(value), "a reason", "a source")
            for name, value in derived
        ),
        objective=ObjectiveSpec((Term("d_min", 1.0),), "fixed", "raw"),
    )


def parameter(
    name: str, low: float = 0.0, high: float = 10.0, default: float | None = None, **more: object
) -> Parameter:
    return Parameter(
        name, Axis.EXTENSION, "1", low, high, low if default is None else default, **more
    )


@pytest.fixture(scope="session")
def build() -> BuildScenario:
    return build_scenario


@pytest.fixture(scope="session")
def make_parameter() -> Callable[..., Parameter]:
    return parameter


@pytest.fixture(scope="session")
def s4() -> LogicalScenario:
    return load("crossroads-s4")


@pytest.fixture(scope="session")
def s4_text() -> str:
    import bridgegen.scenario.catalogue as catalogue

    return (Path(catalogue.__file__).parent / "crossroads-s4.yaml").read_text("utf-8")


@pytest.fixture(scope="session")
def papers_text(s4_text: str) -> str:
    """crossroads-s4 with the paper's objective and thresholds written out."""
    return s4_text[: s4_text.index("objective:")] + PAPERS_OBJECTIVE


PAPERS_OBJECTIVE = """objective: # the fitness of the paper, Section V-A
  terms:
    - {metric: d_min, weight: 0.8297}
    - {metric: v_d, weight: 0.1703}
  weights: fixed
  scale: raw
  critical: # paper, Table III
    n_collision_above: 0
    d_min_below: 2.0 # m
    v_d_at_least: 1.0 # m/s
"""
