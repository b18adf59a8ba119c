"""OpenDRIVE text → model. Everything that is wrong with a file is reported at once, by line.

What matters for driving must be right, or the file is refused. Decoration is read with a warning,
and what can be repaired without a guess at a way to drive is repaired, and said (`repair`).
"""

import math
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from lxml import etree

from bridgegen.base.errors import FileFormatError, UnsupportedError
from bridgegen.openx.opendrive.declaration import DECORATION, ID, Field, plan
from bridgegen.openx.opendrive.geometry import impossible_shape
from bridgegen.openx.opendrive.model import (
    JUNCTION_TYPES,
    Connection,
    Junction,
    LaneSection,
    OpenDrive,
    Road,
)
from bridgegen.openx.opendrive.plan_view import SHARP_CURVATURE, Arc, Geometry, Spiral
from bridgegen.openx.opendrive.repair import Lines, Notes, repair, repair_section
from bridgegen.openx.opendrive.user_data import PREFIX, UserData
from bridgegen.openx.opendrive.validate import broken_references, misnumbered
from bridgegen.openx.xml import parse_xml

NUMBER_LIMIT = 1e9
"""Largest absolute value of any number in a file."""

SHOWN = 20
"""Largest number of problems of a file that are listed."""

_Tree = dict[str, "Field | _Tree"]


def read(
    source: Path | str | bytes,
    place: str | None = None,
    warnings: list[str] | None = None,
    *,
    may_be_empty: bool = False,
) -> OpenDrive:
    """Read a road network.

    What the model has no place for is dropped (see `bridgegen.openx.opendrive.model`).

    Args:
        source: a path, or the document itself as bytes.
        place: what to call it in messages; the path by default.
        warnings: takes a sentence for each kind of thing that was read as something else, was
            repaired or left out, with the line of the first.
        may_be_empty: whether a network without a road is fine, as a storyboard's is whose
            participants go by world positions.

    Raises:
        FileFormatError: unreadable or malformed, or with values, ids or links that cannot be:
            all such problems, with their lines.
        UnsupportedError: it is valid but uses what this version cannot represent.
    """
    path = Path(source) if isinstance(source, str) else source
    place = place or (str(path) if isinstance(path, Path) else "document")
    # Maps come from strangers: `parse_xml` bounds size and depth, and expands no entity.
    root = parse_xml(path, place)
    if _tag(root) != "OpenDRIVE":
        raise FileFormatError(f"{place}: the root element must be OpenDRIVE, got {_tag(root)}")
    reader = _Reader()
    model = reader.record(OpenDrive, root)
    _complain(place, reader)
    assert isinstance(model, OpenDrive)
    if not model.roads and not may_be_empty:
        raise FileFormatError(f"{place}, line {_line(root)}: <OpenDRIVE>: <road> is required")
    # Repairs work on the model, not on the XML: they see links in both directions. References are
    # checked afterwards, since a repair may have removed the one that was broken.
    model = repair(model, reader.lines, reader.notes)
    for record, problem in broken_references(model):
        reader.problems.append((reader.lines[id(record)], problem))
    _complain(place, reader)
    if warnings is not None:
        warnings += reader.notes.sentences(place)
    return model


def _complain(place: str, reader: "_Reader") -> None:
    beyond = [(line, f"{what} is not supported") for line, what in reader.beyond]
    if reader.problems:
        raise FileFormatError(*_sentences(place, reader.problems + beyond))
    if beyond:
        raise UnsupportedError(*_sentences(place, beyond))


def _sentences(place: str, problems: list[tuple[int, str]]) -> Iterator[str]:
    for line, problem in sorted(problems, key=lambda pair: pair[0])[:SHOWN]:
        yield f"{place}, line {line}: {problem}"
    if len(problems) > SHOWN:
        yield f"{place}: and {len(problems) - SHOWN} more such problems"


class _Reader:
    """Builds records from elements, and collects what is wrong.

    Attributes:
        problems: (line, sentence) of everything that cannot be.
        beyond: the same of what is valid but not supported.
        notes: of what was not read as it stands.
        lines: where roads, junctions and connections stand.
    """

    def __init__(self) -> None:
        self.notes = Notes()
        self.problems: list[tuple[int, str]] = []
        self.beyond: list[tuple[int, str]] = []
        self.lines: Lines = {}

    def record(self, cls: type, element: etree._Element) -> Any:
        """Return a record of a class.

        None where anything in it is wrong (and was noted); `_LEFT_OUT` of decoration.
        """
        # One odd value never costs a map: what is driven on must be right, while a record of
        # decoration that cannot be read is left out as a whole, with a warning.
        decoration = getattr(cls, DECORATION, False)
        before = len(self.problems)
        attributes, below, tree = _table(cls)
        values: dict[str, Any] = {}
        for attribute, key in attributes:
            raw = element.get(key)
            if raw is not None:
                values[attribute.name] = self._value(attribute, str(raw), element, decoration)
            elif attribute.form.fallback is not None:
                values[attribute.name] = self._fallback(element, attribute, "missing")
            elif attribute.required:
                self._note(element, f"attribute {key} is required")
        found: dict[str, list[Any]] = {}
        if len(element):
            self._collect(element, tree, found)
        for field in below:
            items = found.get(field.name, [])
            if field.form.role in ("children", "ids"):
                self._require(element, field, len(items) >= field.form.least)
                values[field.name] = tuple(items)
            else:
                if field.form.fallback is not None and not items:
                    items = [self._fallback(element, field, "missing")]
                self._require(element, field, bool(items) or not field.required)
                if len(items) > 1:
                    self._note(element, f"only one <{_name(field)}> is allowed, got {len(items)}")
                values[field.name] = items[0] if items else None
        # A record is made only of valid fields, so no later code meets a half-read one. Reading
        # goes on in any case, so that one call reports all problems of the file.
        if len(self.problems) > before:
            return self._left_out(element, before) if decoration else None
        record = cls(**values)
        # Lane sections are repaired here and not in `repair`: borders and gaps in the count concern
        # one section alone, and the check of the numbering needs the repaired lanes.
        if isinstance(record, LaneSection):
            record = repair_section(record, _line(element), _where(element), self.notes)
            for problem in misnumbered(record):
                self._note(element, problem)
        self._look_at(record, element)
        return record

    def _left_out(self, element: etree._Element, before: int) -> object:
        """Turn the problems of a piece of decoration into one warning."""
        line, problem = self.problems[before]
        del self.problems[before:]
        self.notes.add(
            f"{_tag(element)} left out", line, f"{problem}; the {_tag(element)} is left out"
        )
        return _LEFT_OUT

    def _fallback(self, element: etree._Element, field: Field, problem: str) -> Any:
        value = field.form.fallback
        name = _name(field)
        what = f"{name} is {problem}"
        if field.form.role == "attribute":
            what += f", read as {value}"
        else:
            what = f"<{name}> is {problem}"
        key = f"{_tag(element)} {name} {problem}"
        self.notes.add(key, _line(element), f"{_where(element)}: {what}")
        return value

    def _look_at(self, record: object, element: etree._Element) -> None:
        if isinstance(record, Geometry):
            impossible = impossible_shape(record) if record.length > 0.0 else None
            if impossible:
                self._note(element, impossible)
            sharpest = max((abs(curvature) for curvature in _curvatures(record)), default=0.0)
            if sharpest > SHARP_CURVATURE:
                self.notes.add(
                    "sharp",
                    _line(element),
                    f"{_where(element)}: a curvature of {sharpest:g} /m turns within "
                    f"{1.0 / sharpest:.2g} m, which no vehicle does",
                )
        elif isinstance(record, Road | Junction | Connection):
            if isinstance(record, Road) and not any(
                geometry.length > 0.0 for geometry in record.plan_view
            ):
                self._note(element, "length [m] of a geometry must be > 0, got 0")
            self.lines[id(record)] = _line(element)

    def _collect(self, element: etree._Element, tree: _Tree, found: dict[str, list[Any]]) -> None:
        for item in element:
            tag = _tag(item)
            branch = tree.get(tag)
            if isinstance(branch, Field):
                # The standard lets every tool add userData; that of others means nothing to us.
                if branch.types[0] is UserData and not _is_ours(item):
                    continue
                made = self._item(branch, item)
                if made is not _LEFT_OUT:
                    found.setdefault(branch.name, []).append(made)
            elif branch is not None:
                self._collect(item, branch, found)
            # Unknown elements are passed over in silence, this one is not: it moves the signal that
            # it is in.
            elif (_tag(element), tag) == ("signal", "positionInertial"):
                what = f"{_where(item)} is passed over: the signal stands at its s and t"
                self.notes.add("positionInertial", _line(item), what)

    def _item(self, field: Field, item: etree._Element) -> Any:
        role = field.form.role
        if role == "text":
            return (item.text or "").strip()
        if role == "ids":
            return self._value(ID, str(item.get("id", "")), item)
        # Valid OpenDRIVE, which the ontology has no words for: the file is "not supported", not
        # "wrong".
        if field.types[0] is Junction and item.get("type", "default") not in JUNCTION_TYPES:
            self.beyond.append((_line(item), f"{_where(item)}: type '{item.get('type')}'"))
            return None
        before = len(self.problems)
        made = self.record(field.tags[_tag(item)] if role == "choice" else field.types[0], item)
        if made is None and field.form.decoration:
            return self._left_out(item, before)
        return made

    def _value(
        self, field: Field, raw: str, element: etree._Element, decoration: bool = False
    ) -> Any:
        try:
            return _parse(field, raw)
        except ValueError as error:
            unit = f" [{field.form.unit}]" if field.form.unit else ""
            # A value in a message is cut, for a stranger's file may have megabytes of it in one
            # attribute.
            shown = raw if len(raw) <= 40 else raw[:40] + "…"
            problem = f"{field.form.path[0]}{unit} must be {error}, got '{shown}'"
            if field.form.fallback is not None:
                return self._fallback(element, field, f"'{shown}'")
            optional_number = field.default is None and str not in field.types
            if not field.required and (decoration or optional_number):
                key = f"{_tag(element)} {field.name}"
                self.notes.add(key, _line(element), f"{_where(element)}: {problem}; passed over")
                return field.default
            self._note(element, problem)

    def _require(self, element: etree._Element, field: Field, there: bool) -> None:
        if not there:
            got = ", ".join(_tag(item) for item in element) or "nothing"
            self._note(element, f"<{_name(field)}> is required, got {got}")

    def _note(self, element: etree._Element, problem: str) -> None:
        self.problems.append((_line(element), f"{_where(element)}: {problem}"))


_LEFT_OUT = object()
"""Placeholder for a piece of decoration that could not be read."""


def _curvatures(geometry: Geometry) -> tuple[float, ...]:
    """Return the curvatures that a geometry states [1/m]."""
    shape = geometry.shape
    if isinstance(shape, Arc):
        return (shape.curvature,)
    return (shape.curv_start, shape.curv_end) if isinstance(shape, Spiral) else ()


@cache
def _table(cls: type) -> tuple[list[tuple[Field, str]], list[Field], _Tree]:
    """Return a class's attributes with their names, its other fields, and these by their tags."""
    attributes = [
        (field, field.form.path[0]) for field in plan(cls) if field.form.role == "attribute"
    ]
    below = [field for field in plan(cls) if field.form.role != "attribute"]
    tree: _Tree = {}
    for field in below:
        paths: list[tuple[str, ...]] = [(tag,) for tag in field.tags]
        for path in paths or [field.form.path]:
            level = tree
            for tag in path[:-1]:
                branch = level.setdefault(tag, {})
                assert isinstance(branch, dict)
                level = branch
            level[path[-1]] = field
    return attributes, below, tree


def _parse(field: Field, raw: str) -> float | int | bool | str:
    """Return the value of a text; a ValueError states the valid form."""
    form = field.form
    if form.words and (float not in field.types or raw in form.words):
        if raw not in form.words:
            raise ValueError(f"one of {', '.join(form.words)}")
        return raw
    kind = field.types[0]
    if kind is str:
        return raw
    if kind is bool:
        if raw not in ("true", "false", "1", "0"):
            raise ValueError("true or false")
        return raw in ("true", "1")
    try:
        value = int(raw) if kind is int else float(raw)
        # Python's `float` and `int` take "1_000", "nan" and "inf"; the XSD's types do not, or no
        # length may be such.
        is_number = math.isfinite(value) and "_" not in raw
    except (OverflowError, ValueError):
        is_number = False
    if not is_number:
        raise ValueError("a whole number" if kind is int else "a finite number")
    # Every number has a bound, stated or not, so that no sum or product of lengths overflows later.
    high = NUMBER_LIMIT if form.high is None else form.high
    if abs(value) > high:
        raise ValueError(f"within ±{high:g}")
    if form.above is not None and value <= form.above:
        raise ValueError(f"> {form.above:g}")
    if form.low is not None and value < form.low:
        raise ValueError(f"≥ {form.low:g}")
    return value


def _is_ours(item: etree._Element) -> bool:
    return str(item.get("code", "")).startswith(PREFIX)


def _tag(element: etree._Element) -> str:
    """Return an element's name without its namespace."""
    # Some files declare the standard's namespace and some do not; both are read.
    tag = str(element.tag)
    return tag.rpartition("}")[2] if "}" in tag else tag


def _name(field: Field) -> str:
    return "> or <".join(field.tags) or "/".join(field.form.path)


def _line(element: etree._Element) -> int:
    return element.sourceline or 0


def _where(element: etree._Element) -> str:
    """Return what to call an element: the things with an id that it is in, and its own tag."""
    around = [element, *element.iterancestors()]
    named = [f"{_tag(item)} {item.get('id')}" for item in reversed(around) if item.get("id")]
    own = [] if element.get("id") else [f"<{_tag(element)}>"]
    return ", ".join(named + own)
