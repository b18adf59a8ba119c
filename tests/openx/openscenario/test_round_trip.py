"""What is written reads back, for everything that the model can hold."""

import re
from dataclasses import dataclass
from enum import StrEnum

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from lxml import etree
from tests.approval import refuses

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element, declaration, walk
from bridgegen.openx.openscenario.read import read, verbatim
from bridgegen.openx.openscenario.reader import Reader
from bridgegen.openx.openscenario.values import Kind
from bridgegen.openx.openscenario.write import fill, to_xml

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
            if isinstance(cls, type) and issubclass(cls, StrEnum) and list(cls)
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
    if attribute.is_declared_name:
        return st.sampled_from(["speed", "a_1"])
    if attribute.is_literal:
        return literals
    options = [literals, st.just(osc.ParameterRef(reference))]
    if attribute.enum is not None:
        return st.one_of(options)
    if attribute.takes_expressions:
        options[0] = literals.filter(lambda value: not str(value).startswith("${"))
        options.append(_EXPRESSIONS.map(osc.Expr))
    return st.one_of(options)


_HEADER = st.builds(
    osc.FileHeader,
    rev_major=st.just(1),
    rev_minor=st.integers(0, 3),
    date=_LITERALS[Kind.DATE_TIME],
    description=_STRINGS,
    author=_STRINGS,
    license=st.none() | st.builds(osc.License, name=_STRINGS, text=_STRINGS),
)
_DEEPEST = 40  # elements; more than any file can nest without a loop
_HEIGHTS: dict[type[Element], int] = {}


def _height(cls: type[Element]) -> int:
    """How deep the least element of a class is."""
    if not _HEIGHTS:
        classes = _classes()
        _HEIGHTS.update(dict.fromkeys(classes, _DEEPEST))
        for _ in range(_DEEPEST):
            for one in classes:
                needed = [
                    min(_HEIGHTS[option] for option in child.tags)
                    for child in declaration(one).children
                    if child.at_least
                ]
                _HEIGHTS[one] = 1 + max(needed, default=0)
    return _HEIGHTS[cls]


def _classes() -> list[type[Element]]:
    """Every class that a file may hold, the file's first."""
    found: dict[type[Element], None] = {osc.OpenScenario: None}
    left = [osc.OpenScenario]
    while left:
        for child in declaration(left.pop()).children:
            new = [cls for cls in child.tags if cls not in found]
            found |= dict.fromkeys(new)
            left += new
    return list(found)


def elements(cls: type[Element], depth: int) -> st.SearchStrategy[Element]:
    """Any element of a class that is no deeper, made of its declaration alone."""
    if cls is osc.FileHeader:
        return _HEADER
    if cls is osc.ParameterDeclarations:
        return st.just(_DECLARED)
    if cls is osc.ControllerAction:  # newer versions have one of its children, older ones more
        names = [child.field for child in declaration(cls).children]
        return st.sampled_from(names).flatmap(lambda name: _with(cls, name, depth))
    declared = declaration(cls)
    fields = {}
    for attribute in declared.attributes.values():
        value = _values(attribute)
        fields[attribute.field] = value if attribute.required else st.none() | value
    for child in declared.children:
        room = max(depth - 1, min(_height(option) for option in child.tags))
        options = [option for option in child.tags if _height(option) <= room]
        one = st.one_of([st.deferred(lambda c=c, d=room: elements(c, d)) for c in options])
        if child.at_least == 0 and room > depth - 1:
            continue  # optional, and too deep
        if child.many:
            size = child.at_least
            most = size + 1 if len(child.options) == 1 else 1  # the standard mixes no two kinds
            fields[child.field] = st.lists(one, min_size=size, max_size=most).map(tuple)
        else:
            fields[child.field] = one if child.at_least else st.none() | one
    if declared.text is not None:
        fields[declared.text] = _STRINGS
    return st.builds(cls, **fields)


def _with(cls: type[Element], name: str, depth: int) -> st.SearchStrategy[Element]:
    """An element of a class whose one child is of that name."""
    (child,) = [one for one in declaration(cls).children if one.field == name]
    (option,) = child.tags
    room = max(depth - 1, _height(option))
    return st.builds(cls, **{name: elements(option, room)})


_SLOW = settings(
    max_examples=40, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large]
)


@pytest.mark.parametrize("cls", _classes(), ids=lambda cls: cls.__name__)
def test_reading_what_was_written_gives_the_same_element(cls):
    """For each class of the model: with the least below it, and with two levels more."""

    @settings(max_examples=4, suppress_health_check=list(HealthCheck))
    @given(st.integers(0, 2).flatmap(lambda more: elements(cls, _height(cls) + more)))
    def check(element):
        node = etree.Element("Any")
        fill(node, "Any", element, bare=False)
        text = etree.tostring(node)
        reader = Reader()
        again = reader.element(cls, etree.fromstring(text))
        assert again == element, (reader.malformed, reader.unsupported)
        node = etree.Element("Any")
        fill(node, "Any", again, bare=False)
        assert etree.tostring(node) == text

    check()


@_SLOW
@given(elements(osc.OpenScenario, 10))
def test_reading_what_was_written_gives_the_same_file(scenario):
    data = to_xml(scenario)
    again = verbatim(etree.fromstring(data))
    assert again == scenario
    assert to_xml(again) == data


@pytest.mark.checkers
def test_whatever_the_model_holds_is_valid_by_the_newest_schema(checkers):
    """So the declared names, types and orders are the standard's."""
    schema = checkers.schema("qc_openscenario", "1.3.0/OpenSCENARIO.xsd")

    @_SLOW
    @given(elements(osc.OpenScenario, 12))
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
        (osc.Route("r", False, ()), "Waypoint"),
        (osc.Property("a", "\0"), "Property"),
        (osc.Property("a", "$a"), "reference"),
        (osc.TransitionDynamics("sideways", "time", 0.0), "TransitionDynamics"),
    ],
)
def test_what_no_file_can_hold_is_not_written(bad, text):
    with refuses(ValueError, text):
        fill(etree.Element("Any"), type(bad).__name__, bad, bare=False)
