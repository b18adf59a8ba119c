"""A scenario in another version of the standard means the same."""

from dataclasses import replace

import pytest
from hypothesis import HealthCheck, assume, given, settings
from lxml import etree
from tests.approval import refuses

from bridgegen.base.errors import UnsupportedError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario import write as versions
from bridgegen.openx.openscenario.element import references, rewritten, walk
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.openscenario.write import VERSIONS, to_version, to_xml

from .test_round_trip import elements

_SLOW = settings(
    max_examples=30,
    suppress_health_check=[
        HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much,
    ],
)  # fmt: skip


def _whole(scenario):
    assume(scenario.parameter_declarations is not None or not references(scenario))
    return scenario


@pytest.mark.parametrize("version", VERSIONS)
def test_ours_stays_but_for_the_number(s4, version):
    scenario = read(s4)
    made = to_version(scenario, version, "s4")
    assert made.file_header.rev_minor == VERSIONS[version]
    assert replace(made, file_header=scenario.file_header) == scenario
    assert to_version(made, "1.2", "s4") == scenario


@_SLOW
@given(elements(osc.OpenScenario, 10))
def test_once_is_enough(scenario):
    made = to_version(scenario, "1.3", "any")
    assert to_version(made, "1.3", "any") == made
    for orientation in (one for one in walk(made) if isinstance(one, osc.Orientation)):
        assert orientation.type is not None


@pytest.mark.thorough
@pytest.mark.checkers
@pytest.mark.parametrize(("version", "xsd"), [("1.2", "1.2.0"), ("1.3", "1.3.0")])
def test_whatever_the_model_holds_is_valid_by_the_version_s_schema(checkers, version, xsd):
    schema = checkers.schema("qc_openscenario", f"{xsd}/OpenSCENARIO.xsd")

    @_SLOW
    @given(elements(osc.OpenScenario, 10))
    def check(scenario):
        try:
            made = to_version(_whole(scenario), version, "any")
        except UnsupportedError:
            assume(False)
        assert schema.validate(etree.fromstring(to_xml(made))), schema.error_log

    check()


@pytest.mark.parametrize(("minor", "type_"), [(0, "absolute"), (2, "absolute"), (3, "relative")])
def test_an_orientation_s_missing_type_is_what_its_version_says(s4, minor, type_):
    text = s4.replace(b'revMinor="2"', b'revMinor="%d"' % minor).replace(b'type="relative"', b"")
    scenario = read(text)
    for version in VERSIONS:
        found = [one for one in walk(to_version(scenario, version, "s4"))
                 if isinstance(one, osc.Orientation)]  # fmt: skip
        assert found
        assert {one.type for one in found} == {type_}


def test_old_names_are_the_new_ones(s4):
    old = (
        s4.replace(b'revMinor="2"', b'revMinor="0"')
        .replace(b'"override"', b'"overwrite"')
        .replace(b'"euclidianDistance"', b'"cartesianDistance"')
    )
    assert old.count(b"overwrite") == 1
    assert to_xml(to_version(read(old), "1.2", "s4")) == s4


def test_what_1_3_may_leave_out_is_filled_in(s4):
    def bare(element):
        if isinstance(element, osc.Act):
            return replace(element, start_trigger=None)
        if isinstance(element, osc.Storyboard):
            return replace(element, stop_trigger=None)
        if isinstance(element, osc.Vehicle | osc.Controller):
            return replace(element, properties=None)
        return replace(element, name="c") if isinstance(element, osc.ObjectController) else element

    scenario = to_version(rewritten(read(s4), bare), "1.3", "s4")
    made = to_version(scenario, "1.2", "s4")
    for one in walk(made):
        if isinstance(one, osc.Vehicle | osc.Controller):
            assert one.properties == osc.Properties()
        if isinstance(one, osc.ObjectController):
            assert one.name is None
        if isinstance(one, osc.Act):
            (group,) = one.start_trigger.condition_groups
            clock = group.conditions[0].condition.condition
            assert clock == osc.SimulationTimeCondition(0.0, osc.Rule.GREATER_OR_EQUAL)
    assert made.storyboard.stop_trigger == osc.Trigger()


def test_what_1_2_cannot_say_is_refused_with_its_line(s4):
    def later(element):
        if isinstance(element, osc.Axles):
            return replace(element, front=None)
        if isinstance(element, osc.RelativeDistanceCondition):
            return replace(element, coordinate_system=osc.CoordinateSystem.WORLD)
        return element

    scenario = rewritten(read(s4), later)
    with refuses(UnsupportedError, "FrontAxle", "1.2") as e:
        to_version(scenario, "1.2", "s4")
    assert len(e.value.problems) == 3
    assert to_version(scenario, "1.3", "s4").file_header.rev_minor == 3


@pytest.mark.parametrize("name", ["wheel", ""])
def test_a_controller_s_reference_has_another_name_in_1_2(s4, name):
    action = osc.ActivateControllerAction(lateral=True, object_controller_ref=name)
    made = versions._complete(action)
    assert (made.object_controller_ref, made.controller_ref) == (None, name)
