"""TIER IV's scenario files, OpenSCENARIO 1.x in YAML on Lanelet2 maps: read as XML.

Source: scenario_simulator_v2, docs/developer_guide ("TIER IV Scenario Format version 2.0").
"""

import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

import yaml
from lxml import etree

from bridgegen.base.errors import FileFormatError, UnsupportedError
from bridgegen.openx.lanelet2.convert import lanelets_of
from bridgegen.openx.opendrive.read import read as read_roads
from bridgegen.openx.opendrive.road_map import ROOT, map_bytes
from bridgegen.openx.xml import parse_xml, read_bytes

# The C parser is some ten times faster; which of the two made an event makes no difference.
LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
SUFFIXES = (".yaml", ".yml")
_ROOT = "OpenSCENARIO"
MAX_BYTES, MAX_DEPTH, MAX_ELEMENTS = 2**20, 64, 50_000
MARGIN = 1e-3  # m, from the ends of a lane, to which positions are rounded
EXITS = ("exitSuccess", "exitFailure")
"""Custom commands that end the scenario, with a verdict."""
_PACKAGE = re.compile(
    r"\$\((?:find-pkg-share|ros2 pkg prefix --share) ([\w-]+)\)((?:/[\w-][\w.-]*)*)/?"
)
_NAME = re.compile(r"[A-Za-z]\w*")


def is_storyboard(path: Path | str) -> bool:
    """Return whether a file is called as OpenSCENARIO's are, or is TIER IV's YAML of one."""
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        return path.suffix.lower() == ".xosc"
    try:
        with path.open("rb") as file:
            return (
                re.search(rb"^(ScenarioModifiers|OpenSCENARIO):", file.read(2**16), re.M)
                is not None
            )
    except (OSError, ValueError):
        return False


def root_of(
    source: Path | bytes, place: str | None = None, warnings: list[str] | None = None
) -> etree._Element:
    """Return the root element of a scenario file, in XML or in TIER IV's YAML.

    Args:
        source: a path, or a document in XML.
        place: what to call it in messages; the path by default.
        warnings: takes what is read as something else.

    Raises:
        FileFormatError: as of `parse_xml`; YAML that is not well-formed or that no XML is like, or
            expands to too much; a lanelet or a map that is not found; by line.
        UnsupportedError: ScenarioModifiers, by name.
    """
    if not isinstance(source, Path) or source.suffix.lower() not in SUFFIXES:
        return parse_xml(source, place)
    place = place or str(source)
    entries = dict(_composed(read_bytes(source, place, MAX_BYTES), place))
    modifiers = entries.get("ScenarioModifiers")
    if modifiers is not None and (given := list(_named(modifiers, "name"))):
        raise UnsupportedError(
            f"{place}, line {modifiers.line}: ScenarioModifiers are not supported "
            f"({', '.join(given)[:80]}): they replace text; declare parameters, and vary them by a "
            "ParameterValueDistribution"
        )
    if _ROOT not in entries or not entries[_ROOT].is_mapping:
        raise FileFormatError(f"{place}, line 1: {_ROOT} is required, a mapping")
    root = _Tree(place).element(_ROOT, entries[_ROOT], 0)
    for path in root.iter("Directory", "LogicFile"):
        for name in ("path", "filepath"):
            if named := _PACKAGE.fullmatch(path.get(name, "")):
                where = f"{place}, line {path.sourceline}"
                path.set(name, str(_in_package(named, source, where)))
    header = root.find("FileHeader")
    if header is not None and (header.get("revMajor"), header.get("revMinor")) == ("0", "0"):
        header.set("revMajor", "1")
        header.set("revMinor", "3")
    if _end_at_exits(root) and warnings is not None:
        warnings.append(f"{place}: exitSuccess and exitFailure end the scenario, without a verdict")
    _on_roads(root, source, place)
    return root


class _Node(NamedTuple):
    """A value of a YAML file: a text (None: null), a list of values, or pairs of key and value."""

    line: int
    value: Any
    is_mapping: bool = False


def _composed(data: bytes, place: str) -> list[tuple[str, _Node]]:
    """Return the entries of a YAML file; what an alias stands for is there twice, not copied."""
    anchors: dict[str, _Node] = {}

    def refuse(event: yaml.Event, problem: str) -> NoReturn:
        raise FileFormatError(f"{place}, line {_line(event)}: {problem}")

    def value(event: yaml.Event, depth: int) -> _Node:
        line = _line(event)
        if depth > MAX_DEPTH:
            refuse(event, f"entries may nest {MAX_DEPTH} deep")
        if isinstance(event, yaml.AliasEvent):
            # Of an entry that is not complete yet, there is none: nothing contains itself.
            if event.anchor not in anchors:
                refuse(event, f"*{event.anchor} stands for nothing above")
            return anchors[event.anchor]
        assert isinstance(event, yaml.ScalarEvent | yaml.CollectionStartEvent)
        if event.tag is not None:
            refuse(event, f"tags are refused: {event.tag}")
        if isinstance(event, yaml.ScalarEvent):
            null = not event.style and event.value in ("", "~", "null")
            is_truth = not event.style and event.value in ("True", "False", "TRUE", "FALSE")
            text = event.value.lower() if is_truth else event.value
            made = _Node(line, None if null else text)
        elif isinstance(event, yaml.SequenceStartEvent):
            items = []
            while not isinstance(inner := next(events), yaml.SequenceEndEvent):
                items.append(value(inner, depth + 1))
            made = _Node(line, items)
        else:
            pairs: dict[str, _Node] = {}
            merged: list[tuple[str, _Node]] = []
            while not isinstance(inner := next(events), yaml.MappingEndEvent):
                key = value(inner, depth + 1).value
                below = value(next(events), depth + 1)
                if key == "<<" and below.is_mapping:
                    merged += below.value
                elif not isinstance(key, str) or not _NAME.fullmatch(key) or key in pairs:
                    refuse(inner, f"must be the name of an element, once, got '{str(key)[:40]}'")
                else:
                    pairs[key] = below
            made = _Node(line, list((dict(merged) | pairs).items()), True)
        if event.anchor is not None:
            anchors[event.anchor] = made
        return made

    try:
        events = iter(yaml.parse(data.decode("utf-8-sig"), Loader=LOADER))
        for event in events:
            if isinstance(event, yaml.DocumentStartEvent):
                node = value(next(events), 0)
                return node.value if node.is_mapping else []
    except UnicodeDecodeError as error:
        raise FileFormatError(f"{place}: not UTF-8 at byte {error.start}") from None
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f"{place}, line {mark.line + 1}" if mark else place
        reason = getattr(error, "problem", None) or str(error).splitlines()[0]
        raise FileFormatError(f"{where}: not YAML: {reason}") from None
    return []


def _line(event: yaml.Event) -> int:
    return event.start_mark.line + 1 if event.start_mark else 1


def _named(node: _Node, key: str) -> Iterator[str]:
    """Yield the texts of a key anywhere in a value."""
    for name, below in node.value if node.is_mapping else ():
        if name == key:
            yield str(below.value)
        yield from _named(below, key)
    for below in node.value if isinstance(node.value, list) and not node.is_mapping else ():
        yield from _named(below, key)


class _Tree:
    """Makes elements of a YAML file's values, as many as a file may hold."""

    def __init__(self, place: str) -> None:
        self._place, self._left = place, MAX_ELEMENTS

    def element(self, tag: str, node: _Node, depth: int) -> etree._Element:
        """Return an element: attributes begin with a small letter, elements with a capital."""
        self._left -= 1
        if self._left < 0 or depth > MAX_DEPTH:
            raise FileFormatError(
                f"{self._place}, line {node.line}: a file may have {MAX_ELEMENTS} elements, "
                f"{MAX_DEPTH} deep; aliases make it more"
            )
        element = etree.Element(tag)
        element.sourceline = node.line  # type: ignore[misc]
        try:
            if isinstance(node.value, str):
                element.text = node.value
            elif node.value is not None and not node.is_mapping:
                raise ValueError("must not be a list in a list")
            for key, below in node.value if node.is_mapping else ():
                if key[0].islower():
                    if isinstance(below.value, list):
                        raise ValueError(f"{key} must be one value")
                    element.set(key, below.value or "")
                elif isinstance(below.value, list) and not below.is_mapping:
                    element.extend([self.element(key, item, depth + 1) for item in below.value])
                else:
                    element.append(self.element(key, below, depth + 1))
        except ValueError as error:
            raise FileFormatError(f"{self._place}, line {node.line}: {tag}: {error}") from None
        return element


def _end_at_exits(root: etree._Element) -> bool:
    """Make the events that only end the scenario its StopTrigger; return whether there were any."""
    board = root.find("Storyboard")
    events = [] if board is None else list(board.iter("Event"))
    stop = None if board is None else board.find("StopTrigger")
    found = False
    for event in events:
        kinds = {
            (command.get("type") or "").strip() for command in event.iter("CustomCommandAction")
        }
        trigger, actions = event.find("StartTrigger"), len(list(event.iter("Action")))
        exits = len(list(event.iter("CustomCommandAction")))
        if trigger is None or not kinds or kinds - set(EXITS) or actions != exits:
            continue
        if stop is None and board is not None:
            stop = etree.SubElement(board, "StopTrigger")
        assert stop is not None
        stop.extend(list(trigger))
        found = True
        node: etree._Element = event
        # What is left empty goes, too: a Maneuver has an Event, an Act a ManeuverGroup.
        while (parent := node.getparent()) is not None and node.tag != "Storyboard":
            parent.remove(node)
            if parent.find(str(node.tag)) is not None:
                break
            node = parent
    return found


def _on_roads(root: etree._Element, path: Path, place: str) -> None:
    """Put positions on lanelets on the roads that the map becomes."""
    logic = root.find("RoadNetwork/LogicFile")
    if logic is None:
        return
    road = path.parent / logic.get("filepath", "")
    road = road / "lanelet2_map.osm" if os.path.isdir(road) else road
    logic.set("filepath", str(road))
    if road.suffix.lower() != ".osm":
        return
    model = read_roads(map_bytes(road), str(road))
    lanelets = lanelets_of(model)
    lights = {
        name: signal.id
        for item in model.roads
        for signal in item.signals
        for name in (signal.name or "").split()
    }
    for tag, key in (
        ("TrafficSignalState", "trafficSignalId"),
        ("TrafficSignalStateAction", "name"),
    ):
        for state in root.iter(tag):
            state.set(key, lights.get(state.get(key, ""), state.get(key, "")))
    problems = []
    for position in root.iter("LanePosition"):
        key, s = position.get("laneId", ""), position.get("s", "0")
        if position.get("roadId"):
            continue
        where = f"{place}, line {position.sourceline}"
        try:
            road_id, lane, start, end, length = lanelets[key]
            along = float(s) / length
        except KeyError:
            problems.append(f"{where}: lanelet '{key[:40]}' is not a lane of {road}")
        except ValueError:
            problems.append(f"{where}: s [m] on a lanelet must be a number, got '{s[:40]}'")
        else:
            position.set("roadId", road_id)
            position.set("laneId", str(lane))
            s_road = start + (end - start) * along
            low, high = min(start, end) + MARGIN, max(start, end) - MARGIN
            position.set("s", repr(max(low, min(s_road, high))))
            offset = position.get("offset", "0")
            if end < start and offset.strip("0.-+"):  # t is the road's, not the lanelet's
                position.set("offset", offset[1:] if offset.startswith("-") else f"-{offset}")
    if problems:
        raise FileFormatError(*problems)


def _in_package(named: re.Match[str], path: Path, place: str) -> Path:
    """Return what lies in a ROS package: near the file, or in the folder that --maps names."""
    below = Path(named[1], (named[2] or "").lstrip("/"))
    roots = [Path(os.environ[ROOT])] if os.environ.get(ROOT) else []
    for folder in (*roots, *path.absolute().parents):
        for found in (folder / below, folder / "map" / below, folder / "openscenario" / below):
            if os.path.exists(found):  # "no" of a name that is too long, where Path raises
                return found
    raise FileFormatError(
        f"{place}: the package {named[1]} is not near the file; --maps names the folder "
        "that it is in"
    )
