"""Criteria of CARLA's ScenarioRunner in a scenario file are read, and most are evaluated."""

import pytest
from tests.approval import approve
from tests.campaign.braking import scenario_text, write_pair

from bridgegen.engine.simulate import simulate_file
from bridgegen.jobs.search.scenarios import load

_STATED = (
    ("criteria_CollisionTest", "", ""),
    ("criteria_DrivenDistanceTest", "distance_success", "150"),
    ("criteria_KeepLaneTest", "", ""),
)


@pytest.fixture
def files(tmp_path):
    conditions = "".join(
        f'<Condition name="{name}" delay="0" conditionEdge="rising"><ByValueCondition>'
        f'<ParameterCondition parameterRef="{parameter}" value="{value}" rule="lessThan"/>'
        "</ByValueCondition></Condition>"
        for name, parameter, value in _STATED
    )
    text = scenario_text().replace(
        "<StopTrigger>", f"<StopTrigger><ConditionGroup>{conditions}</ConditionGroup>"
    )
    return write_pair(tmp_path, text=text)


def test_a_file_is_judged_by_them(files):
    result = simulate_file(files[0])
    found = {one.criterion.id: one for one in result.criteria}
    assert list(found) == ["CollisionTest", "DrivenDistanceTest"]
    # The ego has no driver: at 15 m/s it drives on for 12 s, through the car that has stopped.
    assert found["CollisionTest"].verdict == "violated"
    assert found["CollisionTest"].margin == -1.0
    assert found["DrivenDistanceTest"].verdict == "met"
    assert found["DrivenDistanceTest"].margin == pytest.approx(12.0 * 15.0 - 150.0, abs=1.0)
    assert found["DrivenDistanceTest"].unit == "m"
    approve(result.notes, "KeepLaneTest")


def test_a_search_measures_them(files):
    scenario = load(*files)
    assert [one.id for one in scenario.criteria] == ["CollisionTest", "DrivenDistanceTest"]
    approve(scenario.notes, "KeepLaneTest")
