"""Every element, attribute, type and value of the standard's schemas is declared, and no other."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import pytest
from lxml import etree

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element, declaration
from bridgegen.openx.openscenario.values import Kind

pytestmark = pytest.mark.checkers

VERSIONS = ("1.0.0", "1.1.1", "1.2.0", "1.3.0")
ELSEWHERE = {
    "Catalog",
    "ParameterValueDistribution",
}  # files of other kinds, with readers of theirs
_XSD = "{http://www.w3.org/2001/XMLSchema}"
_KINDS = {kind.value[0].upper() + kind.value[1:]: kind for kind in Kind}
_GROUPS = {f"{_XSD}sequence", f"{_XSD}all", f"{_XSD}choice"}


@dataclass
class Type:
    """What the versions together say of a complex type.

    Attributes:
        attributes: by name, the simple type, and whether all versions of the type require it.
        children: by tag, the type.
        versions: that have it.
    """

    attributes: dict[str, tuple[str, bool]] = field(default_factory=dict)
    children: dict[str, str] = field(default_factory=dict)
    versions: int = 0


def _elements(node: etree._Element, groups: dict[str, etree._Element]) -> Iterator[etree._Element]:
    for child in node:
        if child.tag == f"{_XSD}element":
            yield child
        elif child.tag in _GROUPS:
            yield from _elements(child, groups)
        elif child.tag == f"{_XSD}group":
            yield from _elements(groups[child.get("ref")], groups)


@pytest.fixture(scope="module")
def schemas(checkers) -> tuple[dict[str, Type], dict[str, set[str]]]:
    """The complex types and the enumerations of all versions together."""
    types: dict[str, Type] = {}
    values: dict[str, set[str]] = {}
    for version in VERSIONS:
        path = checkers.schema_path("qc_openscenario", f"{version}/OpenSCENARIO.xsd")
        root = etree.parse(path).getroot()
        groups = {one.get("name"): one for one in root.findall(f"{_XSD}group")}
        for simple in root.findall(f"{_XSD}simpleType"):
            found = {one.get("value") for one in simple.iter(f"{_XSD}enumeration")}
            values.setdefault(simple.get("name"), set()).update(found)
        for node in root.findall(f"{_XSD}complexType"):
            one = types.setdefault(node.get("name"), Type())
            first, one.versions = not one.versions, one.versions + 1
            required = {}
            for attribute in node.iter(f"{_XSD}attribute"):
                name, is_required = attribute.get("name"), attribute.get("use") == "required"
                required[name] = is_required and (first or one.attributes.get(name, ("", False))[1])
                one.attributes[name] = attribute.get("type"), required[name]
            for name, (kind, _) in one.attributes.items():
                one.attributes[name] = kind, required.get(name, False)
            one.children |= {each.get("name"): each.get("type") for each in _elements(node, groups)}
    return types, values


def test_nothing_is_missing_and_nothing_is_made_up(schemas):
    types, values = schemas
    left: list[tuple[type[Element], str]] = [(osc.OpenScenario, "OpenScenario")]
    seen = set(left)
    while left:
        cls, name = left.pop()
        declared, there = declaration(cls), types[name]
        assert declared.attributes.keys() == there.attributes.keys(), name
        for attribute in declared.attributes.values():
            kind, required = there.attributes[attribute.name]
            what = f"{attribute.name} of {name}"
            assert attribute.required == required, what
            if kind in _KINDS:
                assert attribute.enum is None, what
                assert attribute.kind is _KINDS[kind], what
            else:
                assert attribute.enum is not None, what
                assert set(attribute.enum) == values[kind], what
        assert declared.by_tag.keys() == there.children.keys() - ELSEWHERE, name
        for tag, child in declared.by_tag.items():
            pair = child.options[tag], there.children[tag]
            if pair not in seen:
                seen.add(pair)
                left.append(pair)
    assert len(seen) > 260
