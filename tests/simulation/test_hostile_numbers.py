"""Numbers in a scenario file that break programs: what `validate` calls valid, `simulate` runs."""

import pytest

from bridgegen.base.errors import FileFormatError, InputError
from bridgegen.engine.simulate import simulate_file
from bridgegen.jobs.search.validate import validate_file
from bridgegen.openx.opendrive.write import to_xml

from .embedded.storyboards import after, crossroads, lane, scenario, speed_action, start

EGO = start("ego", lane(3, 1, 40), 9.0, lane(3, 1, 40), lane(4, -1, 90))
BV = start("bv", lane(2, 2, 80), 4.0)

NUMBERS = (
    "0", "-1", "1e300", "-1e300", "1e999", "INF", "-INF", "NaN", "1e-300", "2147483647",
    "4294967295", "99999999999999999999", "${1e300}", "${0-1e300}", "${1/0}", "${0/0}", "${0.5}",
    "", "1,5", "0x10",
)  # fmt: skip


def text():
    """A file with most of what has numbers."""
    event = f"""<Story name="s"><Act name="a"><ManeuverGroup name="g" maximumExecutionCount="1">
<Actors selectTriggeringEntities="false"><EntityRef entityRef="bv"/></Actors><Maneuver name="m">
<Event name="faster" priority="parallel" maximumExecutionCount="1"><Action name="x">
<PrivateAction><LongitudinalAction>{speed_action(8.0, "linear time 1.5")}</LongitudinalAction>
</PrivateAction></Action><StartTrigger><ConditionGroup>{after(0.5)}</ConditionGroup></StartTrigger>
</Event><Event name="over" priority="parallel" maximumExecutionCount="3"><Action name="y">
<PrivateAction><LateralAction><LaneChangeAction targetLaneOffset="0.25"><LaneChangeActionDynamics
dynamicsShape="sinusoidal" dynamicsDimension="time" value="2.5"/><LaneChangeTarget>
<RelativeTargetLane entityRef="bv" value="1"/></LaneChangeTarget></LaneChangeAction>
</LateralAction></PrivateAction></Action><StartTrigger><ConditionGroup>{after(1.25)}
</ConditionGroup></StartTrigger></Event></Maneuver></ManeuverGroup></Act></Story>"""
    return scenario(("ego", "bv"), EGO + BV).replace("</Init>", "</Init>" + event)


PLACES = (
    'width="2.0"', 'length="4.0"', 'height="1.5"', 'x="1.4"', 'maxSpeed="60"',
    'maxAcceleration="5"', 'maxDeceleration="9"', 'maxSteering="0.6"', 'wheelDiameter="0.6"',
    'ManeuverGroup name="g" maximumExecutionCount="1"',
    'priority="parallel" maximumExecutionCount="1"', 'maximumExecutionCount="3"',
    'targetLaneOffset="0.25"', 'dynamicsDimension="time" value="2.5"',
    'entityRef="bv" value="1"', 'value="8.0"', 'value="1.25"', 's="40"', 'value="1.5"',
    'value="9.0"',
)  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hostile")
    (folder / "map.xodr").write_bytes(to_xml(crossroads()))
    return folder


def test_the_file_is_valid_and_runs(folder):
    path = folder / "whole.xosc"
    path.write_text(text(), "utf-8")
    assert validate_file(path) == []
    assert simulate_file(path).status == "ok"


@pytest.mark.thorough
@pytest.mark.parametrize("place", PLACES)
def test_validate_and_simulate_agree(folder, place):
    whole = text()
    assert place in whole
    for number in NUMBERS:
        old = place.rpartition('="')[0]
        path = folder / "changed.xosc"
        path.write_text(whole.replace(place, f'{old}="{number}"', 1), "utf-8")
        wrong = validate_file(path)
        refused = None
        try:
            simulate_file(path)
        except InputError as error:  # valid, but not supported or without a lane to change to
            refused = type(error) is FileFormatError
        assert bool(refused) == bool(wrong), number


@pytest.mark.parametrize("number", ["-1", "INF", "${1/0}", "1e999"])
@pytest.mark.parametrize("place", ['width="2.0"', 'length="4.0"'])
def test_a_box_has_a_size(folder, place, number):
    path = folder / "flat.xosc"
    path.write_text(text().replace(place, f'{place[:-5]}"{number}"', 1), "utf-8")
    said = validate_file(path)
    assert len(said) == 1
    assert f"{place.partition('=')[0]}" in said[0]
    with pytest.raises(FileFormatError) as error:
        simulate_file(path)
    assert error.value.problems == tuple(said)
