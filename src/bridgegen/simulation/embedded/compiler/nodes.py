"""The elements of a storyboard in the order of the file."""

from collections.abc import Sequence
from dataclasses import dataclass

from bridgegen.openx.openscenario import model as osc
from bridgegen.simulation.embedded import _codes as codes

Part = osc.Story | osc.Act | osc.ManeuverGroup | osc.Maneuver | osc.Event | osc.Action

_KINDS = {
    osc.Story: codes.STORY, osc.Act: codes.ACT, osc.ManeuverGroup: codes.GROUP,
    osc.Maneuver: codes.MANEUVER, osc.Event: codes.EVENT, osc.Action: codes.ACTION,
}  # fmt: skip


@dataclass(frozen=True)
class Node:
    """An element of the storyboard: its place in the order of the file, its name and parents.

    Attributes:
        part: the element.
        kind: see ``_codes``.
        path: names from the story's to its own.
        parent: number of its parent; -1 of a story.
        end: number of the first element after it that is not in it.
    """

    part: Part
    kind: int
    path: tuple[str, ...]
    parent: int
    end: int


def nodes(storyboard: osc.Storyboard) -> list[Node]:
    """Return all elements in the order of the file, each before its children."""
    found: list[Node] = []
    for story in storyboard.stories:
        _append(found, story, (), -1)
    return found


def _append(found: list[Node], part: Part, path: tuple[str, ...], parent: int) -> None:
    number, path = len(found), (*path, str(part.name))
    kind = _KINDS[type(part)]
    found.append(Node(part, kind, path, parent, 0))
    for child in _children(part):
        _append(found, child, path, number)
    found[number] = Node(part, kind, path, parent, len(found))


def _children(part: Part) -> Sequence[Part]:
    match part:
        case osc.Story():
            return part.acts
        case osc.Act():
            return part.maneuver_groups
        case osc.ManeuverGroup():
            return part.maneuvers
        case osc.Maneuver():
            return part.events
        case osc.Event():
            return part.actions
    return ()
