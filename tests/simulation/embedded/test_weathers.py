"""The weather of a rollout, told afterwards, is the one that the simulator had at each instant."""

from dataclasses import replace

import numpy as np
import pytest

from bridgegen.drivers import _weather_columns as column
from bridgegen.simulation.embedded.batch import Batch

from .storyboards import after, crossroads, lane, scenario, simulator, start

EGO = start("ego", lane(1, 1, 90.0), 5.0)


def raining(rate: str, distance: str) -> str:
    return f"""<GlobalAction><EnvironmentAction><Environment name="e"><Weather>
<Fog visualRange="{distance}"/><Precipitation precipitationType="rain"
precipitationIntensity="{rate}"/></Weather></Environment></EnvironmentAction></GlobalAction>"""


def weather_event(name: str, seconds: float, action: str) -> str:
    return f"""<ManeuverGroup name="{name}" maximumExecutionCount="1">
<Actors selectTriggeringEntities="false"/><Maneuver name="{name}"><Event name="{name}"
priority="override" maximumExecutionCount="1"><Action name="{name}">{action}</Action><StartTrigger>
<ConditionGroup>{after(seconds)}</ConditionGroup></StartTrigger></Event></Maneuver>
</ManeuverGroup>"""


def test_it_is_the_simulators_own_at_every_instant():
    declared = '<ParameterDeclaration name="sight" parameterType="double" value="400"/>'
    made = simulator(
        scenario(
            ("ego",), EGO,
            weather_event("fog", 2.0, raining("4", "60"))
            + weather_event("later", 5.0, raining("0", "$sight"))
            + weather_event("never", 99.0, raining("50", "10")),
            environment=raining("1", "$sight"), parameters=declared,
        )
    )  # fmt: skip
    roads, rows = made.roads([crossroads()]), np.zeros(2, dtype=np.int64)
    values = {"sight": np.array([400.0, 90.0])}
    rollout = made.run(roads, rows, values)
    for row in (0, 1):
        told = made.weathers(values, rollout, row)
        changed = [k * rollout.time_step for k, _ in told]
        assert changed == pytest.approx([0.0, 2.0, 5.0], abs=rollout.time_step)
        for at in (0, 1, 30, told[1][0] - 1, told[1][0], 60, told[2][0] - 1, told[2][0], 150):
            batch = Batch(replace(made.program, n_steps=at + 1), roads, rows, values)
            batch.run()
            now = next(one for k, one in reversed(told) if k <= at)
            had = batch.state.weather[row]
            assert now[: column.SIGHT].tolist() == had[: column.SIGHT].tolist(), at
    assert told[0][1][column.VISUAL_RANGE] == told[2][1][column.VISUAL_RANGE] == 90.0
