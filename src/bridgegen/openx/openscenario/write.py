"""From the model to an OpenSCENARIO file, driven by the model's declaration."""

from typing import TYPE_CHECKING, Any

from lxml import etree

from bridgegen.openx.openscenario.element import (
    RAW,
    Attribute,
    Element,
    children_of,
    declaration,
    is_wrapper,
    values_of,
)
from bridgegen.openx.openscenario.storyboard import OpenScenario
from bridgegen.openx.openscenario.values import ParameterRef, format_value

if TYPE_CHECKING:
    from bridgegen.openx.openscenario.distributions import DistributionFile


def to_xml(scenario: "OpenScenario | DistributionFile") -> bytes:
    """Return the file: UTF-8, indented, the same bytes for the same model.

    Numbers are written so that reading gives the same double back. A file of version 1.0 has what
    later versions wrap (a trajectory, in a ``TrajectoryRef``) bare.

    Raises:
        TypeError: a value of another type than its attribute's.
        ValueError: NaN, a text that XML or the standard cannot hold, or too few children.
    """
    root = etree.Element("OpenSCENARIO")
    fill(root, "OpenSCENARIO", scenario, bare=scenario.file_header.rev_minor == 0)
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)


def _text(attribute: Attribute, value: Any) -> str:
    if attribute.means is RAW and isinstance(value, str):
        return value
    if attribute.enum is not None and not isinstance(value, ParameterRef):
        value = attribute.enum(value).value
    text = format_value(attribute.kind, value)
    if attribute.takes_expressions and isinstance(value, str) and text.startswith("${"):
        raise ValueError(f"the text '{text}' would be read as an expression")
    return text


def fill(node: etree._Element, tag: str, element: Element, *, bare: bool) -> None:
    """Give a node what an element has.

    Args:
        node: an empty one.
        tag: its own, for messages.
        element: what it shall be.
        bare: as of version 1.0, without what later versions wrap.

    Raises:
        TypeError: as of `to_xml`.
        ValueError: likewise.
    """
    declared = declaration(type(element))
    try:
        for attribute, value in values_of(element):
            node.set(attribute.name, _text(attribute, value))
        if declared.text is not None:
            node.text = getattr(element, declared.text)
    except (TypeError, ValueError) as error:
        raise type(error)(f"{tag}: {error}") from None
    for child in declared.children:
        if child.many and len(getattr(element, child.field)) < child.at_least:
            names = " or ".join(child.options)
            raise ValueError(f"{tag} must have at least {child.at_least} {names}")
    for name, below in children_of(element):
        wrapped = bare and is_wrapper(element, below)
        for each, one in children_of(below) if wrapped else ((name, below),):
            fill(etree.SubElement(node, each), each, one, bare=bare)
