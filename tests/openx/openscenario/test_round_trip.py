"""What is written reads back, for everything that the model can hold."""

import re
from dataclasses import dataclass
from enum import StrEnum

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from lxml import etree

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element, declaration, references, walk
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.openscenario.values import Kind
from bridgegen.openx.openscenario.write import _fill, to_xml

_TEXT = st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Cs", "Cn")), max_size=8)
_ODD = st.sampled_from(["\n", "\t x", " ", "<&>\"'", "ä∑🚗", "$", "$ a", "${a}"])
_STRINGS = st.one_of(_TEXT, _ODD).filter(lambda text: not re.match(r"\$[A-Za-z_]", text))
_LITERALS = {
    Kind.BOOLEAN: st.booleans(),
    Kind.DATE_TIME: st.datetimes().map(lambda t: t.replace(year=2000).isoformat()),
    Kind.DOUBLE: st.floats(allow_nan=False),
    Kind.INT: st.integers(-(2**31), 2**31 - 1),
    Kind.STRING: _STRINGS,
    Kind.UNSIGNED_INT: st.integers(0, 2**32 - 1),
    Kind.UNSIGNED_SHORT: st.integers(0, 2**16 - 1),
}
_DECLARED = osc.ParameterDeclarations(
    (
        *(
            osc.ParameterDeclaration(f"p_{kind.value}", osc.ParameterType(kind.value), text)
            for kind, text in {
                Kind.BOOLEAN: "true",
                Kind.DATE_TIME: "2020-01-01T00:00:00",
                Kind.DOUBLE: "1.5",
                Kind.INT: "-1",
                Kind.STRING: "x",
                Kind.UNSIGNED_INT: "3",
                Kind.UNSIGNED_SHORT: "4",
            }.items()
        ),
        *(
            osc.ParameterDeclaration(f"p_{name}", osc.ParameterType.STRING, next(iter(cls)))
            for name, cls in vars(osc).items()
            if isinstance(cls, type) and issubclass(cls, StrEnum)
        ),
    )
)
_EXPRESSIONS = st.sampled_from(["${$p_double*2}", "${ 1.5 - ($p_int) }", "${pow($p_double,2)}"])


def _values(attribute):
    if attribute.enum is not None:
        literals = st.sampled_from(list(attribute.enum))
        reference = f"$p_{attribute.enum.__name__}"
    else:
        literals = _LITERALS[attribute.kind]
        reference = f"$p_{attribute.kind.value}"
    if attribute.is_literal:
        return literals
    options = [literals, st.just(osc.ParameterRef(reference))]
    if attribute.enum is not None:
        return st.one_of(options)
    if attribute.kind not in (Kind.STRING, Kind.DATE_TIME):
        options.append(_EXPRESSIONS.map(osc.Expr))
    return st.one_of(options)


_FIXED = {
    osc.ParameterDeclarations: st.just(_DECLARED),
    osc.FileHeader: st.builds(
        osc.FileHeader,
        rev_major=st.just(1),
        rev_minor=st.integers(0, 3),
        date=_LITERALS[Kind.DATE_TIME],
        description=_STRINGS,
        author=_STRINGS,
        license=st.none() | st.builds(osc.License, name=_STRINGS, text=_STRINGS),
        properties=st.none() | st.deferred(lambda: elements(osc.Properties)),
    ),
}


def elements(cls: type[Element]) -> st.SearchStrategy[Element]:
    """Any element of a class, made of its declaration alone."""
    if cls in _FIXED:
        return _FIXED[cls]
    declared = declaration(cls)
    fields = {}
    for attribute in declared.attributes.values():
        value = _values(attribute)
        fields[attribute.field] = value if attribute.required else st.none() | value
    for child in declared.children:
        one = st.one_of([st.deferred(lambda c=c: elements(c)) for c in child.options.values()])
        if child.many:
            size = child.at_least
            fields[child.field] = st.lists(one, min_size=size, max_size=size + 1).map(tuple)
        else:
            fields[child.field] = one if child.at_least else st.none() | one
    if declared.text is not None:
        fields[declared.text] = _STRINGS
    return st.builds(cls, **fields)


_SLOW = settings(
    max_examples=40, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large]
)


@_SLOW
@given(elements(osc.OpenScenario))
def test_reading_what_was_written_gives_the_same_model(scenario):
    if scenario.parameter_declarations is None and references(scenario):
        scenario = osc.OpenScenario(**vars(scenario) | {"parameter_declarations": _DECLARED})
    data = to_xml(scenario)
    again = read(data)
    assert again == scenario
    assert to_xml(again) == data


@pytest.mark.checkers
def test_whatever_the_model_holds_is_valid_by_the_newest_schema(checkers):
    """So the declared names, types and orders are the standard's."""
    schema = checkers.schema("qc_openscenario", "1.3.0/OpenSCENARIO.xsd")

    @_SLOW
    @given(elements(osc.OpenScenario))
    def check(scenario):
        assert schema.validate(etree.fromstring(to_xml(scenario))), schema.error_log

    check()


def test_every_element_remembers_its_line(s4):
    lines = s4.decode().splitlines()
    for element in walk(read(s4)):
        if isinstance(element, osc.Property):
            assert f'name="{element.name}"' in lines[element.line - 1]
        if isinstance(element, osc.OpenScenario):
            assert element.line == 2


def test_elements_are_equal_wherever_they_stand():
    assert osc.Property("a", "b", line=3) == osc.Property("a", "b", line=4)
    assert osc.Property("a", "b") != osc.Property("a", "c")


def test_numbers_survive_exactly(s4):
    value = 0.1 + 0.2
    data = s4.replace(b'tolerance="2.0"', f'tolerance="{value!r}"'.encode())
    found = [e for e in walk(read(data)) if isinstance(e, osc.ReachPositionCondition)]
    assert found[0].tolerance == value


def test_a_class_that_declares_nonsense_is_a_programming_error():
    class Odd(Element):
        __annotations__ = {"what": list}

    with pytest.raises(TypeError, match=r"Odd\.what"):
        declaration(dataclass(frozen=True)(Odd))


@pytest.mark.parametrize(
    ("bad", "text"),
    [
        (osc.Route("r", False, ()), "Route must have at least 2 Waypoint"),
        (osc.Property("a", "\0"), "Property"),
        (osc.Property("a", "$a"), "reference"),
        (osc.TransitionDynamics("sideways", "time", 0.0), "sideways"),
    ],
)
def test_what_no_file_can_hold_is_not_written(bad, text):
    with pytest.raises(ValueError, match=text):
        _fill(etree.Element("Any"), type(bad).__name__, bad)
