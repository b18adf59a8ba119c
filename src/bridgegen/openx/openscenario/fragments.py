"""Single elements of OpenSCENARIO as text: what the ontology keeps in OpenSCENARIO's own words."""

from collections.abc import Mapping

from lxml import etree

from bridgegen.base.errors import FileFormatError
from bridgegen.openx.openscenario.element import Element
from bridgegen.openx.openscenario.reader import element_of
from bridgegen.openx.openscenario.write import fill
from bridgegen.openx.xml import parse_xml


def fragment_of(element: Element) -> str:
    """Return an element and all below it as XML, on one line."""
    tag = type(element).__name__
    node = etree.Element(tag)
    fill(node, tag, element, bare=False)
    return str(etree.tostring(node, encoding="unicode"))


def element_from(text: str, options: Mapping[str, type[Element]], place: str) -> Element:
    """Return the element that a fragment is.

    Args:
        text: the XML.
        options: tag → class, all that it may be.
        place: what to call it in messages.

    Raises:
        FileFormatError: not well-formed, hostile, malformed, or another element.
        UnsupportedError: elements or attributes that this version of BridgeGen cannot run.
    """
    root = parse_xml(text.encode("utf-8"), place)
    cls = options.get(str(root.tag))
    if cls is None:
        raise FileFormatError(f"{place}: must be {' or '.join(options)}, got {root.tag!s}")
    return element_of(cls, root, place)
