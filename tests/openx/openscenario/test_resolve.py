"""Parameters give way to their values."""

import pytest
from tests.approval import refuses

from bridgegen.base.errors import FileFormatError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import references, values_of, walk
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.openscenario.resolve import resolved
from bridgegen.openx.openscenario.values import resolve
from bridgegen.openx.openscenario.write import to_xml


def test_every_value_is_what_it_was(s4):
    scenario = read(s4)
    made = resolved(scenario, "s4")
    assert not references(made)
    assert made.parameter_declarations is None
    values = {one.name: one.value for one in scenario.parameter_declarations.parameters}
    numbers = {
        name: float(value) for name, value in values.items() if value.lstrip("-")[0].isdigit()
        and ":" not in value
    }  # fmt: skip
    old = [
        one
        for one in walk(scenario)
        if not type(one).__name__.startswith(("Parameter", "Value", "Constraint"))
    ]
    new = list(walk(made))
    assert len(old) == len(new)
    for before, after in zip(old, new, strict=True):
        for (attribute, a), (_, b) in zip(values_of(before), values_of(after), strict=True):
            if isinstance(a, osc.ParameterRef) and not attribute.kind.is_number:
                assert b == values[a.name]
            else:
                assert b == resolve(a, numbers), attribute
    assert read(to_xml(made)) == made


def test_types(s4):
    declared = b"""<ParameterDeclarations>
<ParameterDeclaration name="yes" parameterType="boolean" value="false"/>
<ParameterDeclaration name="edge" parameterType="string" value="rising"/>
<ParameterDeclaration name="once" parameterType="integer" value="1"/>
<ParameterDeclaration name="number" parameterType="double" value="1.50"/>"""
    text = (
        s4.replace(b"<ParameterDeclarations>", declared)
        .replace(b'maximumExecutionCount="1"', b'maximumExecutionCount="${$once*1}"', 1)
        .replace(b'maximumExecutionCount="1"', b'maximumExecutionCount="$once"', 1)
        .replace(b'selectTriggeringEntities="false"', b'selectTriggeringEntities="$yes"')
        .replace(b'conditionEdge="none"', b'conditionEdge="$edge"')
        .replace(b'delay="0.0"', b'delay="$once"')
        .replace(b'author="BridgeGen"', b'author="$number"')
    )
    made = resolved(read(text), "s4")
    assert made.file_header.author == "1.50"
    for one in walk(made):
        if isinstance(one, osc.Condition):
            assert one.condition_edge is osc.ConditionEdge.RISING
            assert isinstance(one.delay, float)
            assert one.delay == 1.0
        if isinstance(one, osc.Actors):
            assert one.select_triggering_entities is False
        if isinstance(one, osc.ManeuverGroup | osc.Event):
            assert type(one.maximum_execution_count) is int
    assert read(to_xml(made)) == made


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        (
            b'delay="0.0"',
            b'delay="${1/($ego_speed-$ego_speed)}"',
            "Condition",
        ),
        (b'maximumExecutionCount="1"', b'maximumExecutionCount="${1/2}"', "number"),
    ],
)
def test_what_has_no_value_is_refused_with_its_line(s4, old, new, text):
    with refuses(FileFormatError, text) as error:
        resolved(read(s4.replace(old, new)), "s4")
    assert all(one.startswith("s4: ") and "(line " in one for one in error.value.problems)
