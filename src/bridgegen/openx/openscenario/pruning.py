"""Cutting out of a file what is not supported, so that what is left means what it meant.

An action that an event cannot do, or a condition that cannot be watched, makes another event of
it: the whole event goes. The rest stays as it is.
"""

from lxml import etree

_WHOLES = frozenset(
    {
        "ConditionGroup", "Event", "GlobalAction", "ObjectController", "ParameterDeclaration",
        "PrivateAction", "ScenarioObject", "TrafficSignalController",
    }
)  # fmt: skip
_NEVER_EMPTY = frozenset({"Act", "Maneuver", "Private", "Story"})
_LOCAL = "ParameterDeclarations"  # of a story or a maneuver: what is below refers to them


def prune(node: etree._Element, attribute: str | None = None) -> None:
    """Cut out an attribute, or an element with the event, action or entity that it is part of.

    Args:
        node: not the root.
        attribute: of the element; None if all of it is to go.
    """
    if attribute is not None:
        node.attrib.pop(attribute, None)
        return
    parent = node.getparent()
    whole = node if node.tag != _LOCAL or parent is None else parent
    above = node
    while (parent := above.getparent()) is not None:
        if above.tag in _WHOLES:
            whole = above
            if above.tag in ("Event", "ScenarioObject"):
                break
        above = parent
    _remove(whole)


def _remove(node: etree._Element) -> None:
    parent = node.getparent()
    if parent is None:  # the root, or gone already
        return
    parent.remove(node)
    if parent.tag in _NEVER_EMPTY and not any(child.tag == node.tag for child in parent):
        _remove(parent)
