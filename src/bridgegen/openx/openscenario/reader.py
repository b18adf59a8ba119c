"""From XML elements to the model's, driven by the model's declaration.

What the model does not declare is refused by name and line, never skipped: a scenario that is read
is a scenario that is understood.
"""

from contextlib import suppress
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Any, TypeVar, cast

from lxml import etree

from bridgegen.base.errors import FileFormatError, UnsupportedError
from bridgegen.openx.openscenario.element import RAW, Attribute, Declaration, Element, declaration
from bridgegen.openx.openscenario.pruning import prune
from bridgegen.openx.openscenario.values import Expr, ParameterRef, parse_value

MAX_PROBLEMS = 50
_ENOUGH = 1000  # problems; a file with more is not worth reading on
_LABELLED = ("Story", "Act", "ManeuverGroup", "Maneuver", "Action", "Condition")
"""Elements whose names are for people; a file may be without."""
_HINT = "{http://www.w3.org/2001/XMLSchema-instance}"  # where to find an XSD: no content

E = TypeVar("E", bound=Element)


def element_of(
    cls: type[E],
    node: etree._Element,
    place: str,
    skipped: list[str] | None = None,
    warnings: list[str] | None = None,
) -> E:
    """Return a node and all below it as the model's.

    Args:
        cls: of the element.
        node: its XML; what is not supported is cut out of it if ``skipped`` is given.
        place: what to call the document in messages.
        skipped: as of `bridgegen.openx.openscenario.read.read`.
        warnings: likewise.

    Raises:
        FileFormatError: malformed, all of it at once (at most 50 problems).
        UnsupportedError: nothing is wrong but what the model has no place for.
    """
    while True:
        reader = Reader()
        element: Element | None = None
        with suppress(_EnoughError):
            element = reader.element(cls, node)
        if skipped is None or reader.malformed or not reader.unsupported:
            break
        skipped += [f"{place}: {text} (line {line})" for line, text in reader.unsupported]
        for culprit, name in reader.culprits:
            prune(culprit, name)
    reader.raise_problems(place)
    if warnings is not None:
        warnings += [f"{place}: {text} (line {line})" for line, text in reader.odd]
    return cast(E, element)


def shorten(problems: list[str]) -> list[str]:
    """Return the first problems, and how many more there are."""
    more = len(problems) - MAX_PROBLEMS
    if more <= 0:
        return problems
    least = "at least " if len(problems) == _ENOUGH else ""
    return [*problems[:MAX_PROBLEMS], f"… and {least}{more} more problems"]


class _EnoughError(Exception):
    """The maximum number of problems is reached."""


@dataclass
class Reader:
    """Turns XML elements into model elements and collects what is wrong with them."""

    malformed: list[tuple[int, str]] = field(default_factory=list)
    unsupported: list[tuple[int, str]] = field(default_factory=list)
    culprits: list[tuple[etree._Element, str | None]] = field(default_factory=list)
    odd: list[tuple[int, str]] = field(default_factory=list)

    def raise_problems(self, place: str) -> None:
        """Raise one error with all problems in the order of the file, if there are any."""
        problems = sorted(self.malformed + self.unsupported, key=lambda problem: problem[0])
        if problems:
            error = FileFormatError if self.malformed else UnsupportedError
            texts = [f"{place}: {text} (line {line})" for line, text in problems]
            raise error(*shorten(texts))

    def wrong(self, node: etree._Element, text: str) -> None:
        """Note what is malformed at a node."""
        self._note(self.malformed, node, text)

    def unknown(self, node: etree._Element, text: str, attribute: str | None = None) -> None:
        """Note what the model has no place for: a node, or an attribute of it."""
        self._note(self.unsupported, node, text)
        self.culprits.append((node, attribute))

    def _note(self, problems: list[tuple[int, str]], node: etree._Element, text: str) -> None:
        if len(self.malformed) + len(self.unsupported) == _ENOUGH:
            raise _EnoughError
        problems.append((node.sourceline or 0, text))

    def element(self, cls: type[Element], node: etree._Element) -> Element | None:
        """Return the model's element, or None if any part of it is wrong."""
        declared = declaration(cls)
        before = len(self.malformed) + len(self.unsupported)
        values = self._attributes(declared, node) | self._children(declared, node)
        if declared.text is not None:
            values[declared.text] = node.text or ""
        else:
            texts = [node.text, *(child.tail for child in node)]
            text = next((t for text in texts if text and (t := text.strip(" \t\r\n"))), "")
            if text:
                self.wrong(node, f"{_tag(node)} holds no text, got '{text[:40]}'")
        if len(self.malformed) + len(self.unsupported) > before:
            return None
        return cls(**values, line=node.sourceline or 0)

    def _attributes(self, declared: Declaration, node: etree._Element) -> dict[str, Any]:
        values: dict[str, Any] = {}
        for name, text in node.items():
            name, text = str(name), str(text)
            attribute = declared.attributes.get(name)
            if attribute is None:
                if not name.startswith(_HINT):
                    hint = _nearest(name, declared.attributes)
                    self.unknown(
                        node, f"attribute {name} of {_tag(node)} is not supported{hint}", name
                    )
            else:
                if attribute.is_declared_name:
                    text = text.removeprefix("$")
                try:
                    value = values[attribute.field] = _value(attribute, text)
                except FileFormatError as error:
                    self.wrong(node, f"{name} of {_tag(node)} {error}")
                else:
                    if attribute.is_literal and isinstance(value, ParameterRef | Expr):
                        what = f"a reference as {name} of {_tag(node)}"
                        self.unknown(node, f"{what} is not supported, got {value}", name)
        for attribute in declared.attributes.values():
            if not attribute.required or attribute.name in node.attrib:
                continue
            if attribute.name == "name" and _tag(node) in _LABELLED:
                values[attribute.field] = _tag(node)
                self.odd.append((node.sourceline or 0, f"{_tag(node)} should have a name"))
            else:
                self.wrong(node, f"{_tag(node)} must have the attribute {attribute.name}")
        return values

    def _children(self, declared: Declaration, node: etree._Element) -> dict[str, Any]:
        found: dict[str, list[Element | None]] = {child.field: [] for child in declared.children}
        complete = True
        for sub in node:
            tag = _tag(sub)
            child = declared.by_tag.get(tag)
            if child is None:
                self.unknown(sub, f"{tag} in {_tag(node)} is not supported")
                complete = False
            else:
                element = self.element(child.options[tag], sub)
                found[child.field].append(element and child.wrapped(element))
        values: dict[str, Any] = {}
        for child in declared.children:
            got = found[child.field]
            names = " or ".join(child.options)
            if complete and len(got) < child.at_least:  # else an unknown one may stand for it
                count = f"at least {child.at_least} " if child.many else ""
                self.wrong(node, f"{_tag(node)} must have {count}{names}")
            if len(got) > 1 and not child.many:
                self.wrong(node, f"{_tag(node)} must have one {names}, got {len(got)}")
            values[child.field] = tuple(got) if child.many else got[0] if got else None
        return values


def _tag(node: etree._Element) -> str:
    return str(node.tag)


def _value(attribute: Attribute, text: str) -> Any:
    if attribute.means is RAW:
        return text
    value = parse_value(attribute.kind, text, expressions=attribute.takes_expressions)
    if attribute.enum is None or isinstance(value, ParameterRef):
        return value
    try:
        return attribute.enum(text)
    except ValueError:
        known = ", ".join(attribute.enum)
        raise FileFormatError(f"must be one of {known}, got '{text[:80]}'") from None


def _nearest(name: str, known: dict[str, Attribute]) -> str:
    near = get_close_matches(name, known, n=1, cutoff=0.7)
    return f"; did you mean {near[0]}?" if near else ""
