"""From an OpenSCENARIO file to the model, driven by the model's declaration.

What the model does not declare is refused by name and line, never skipped: a scenario that is read
is a scenario that is understood.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any, cast

from lxml import etree

from bridgegen.errors import FileFormatError, UnsupportedError
from bridgegen.openx.openscenario import parameters
from bridgegen.openx.openscenario.catalog_files import CatalogReference
from bridgegen.openx.openscenario.element import Attribute, Declaration, Element, declaration
from bridgegen.openx.openscenario.pruning import prune
from bridgegen.openx.openscenario.storyboard import OpenScenario
from bridgegen.openx.openscenario.values import Expr, ParameterRef, parse_value
from bridgegen.openx.xml import parse_xml

VERSIONS = ("1.0", "1.1", "1.2", "1.3")
DISTRIBUTION = "ParameterValueDistribution"
MAX_PROBLEMS = 50
_ENOUGH = 1000  # problems; a file with more is not worth reading on
_LOCAL = "ParameterDeclarations"  # of a story, a vehicle …; an empty list of them says nothing
_HINT = "{http://www.w3.org/2001/XMLSchema-instance}"  # where to find an XSD: no content


def read(
    source: Path | str | bytes, place: str | None = None, *, skipped: list[str] | None = None
) -> OpenScenario:
    """Read a scenario file of version 1.0 to 1.3.

    Children may stand in any order. Parameters are checked too: each is declared once, with a
    value of its type within its constraints, and what refers to it exists and fits.

    Args:
        source: a path, or the document itself as bytes.
        place: what to call it in messages; the path by default.
        skipped: takes a sentence for each thing that is not supported, which is left out then
            instead of refused: an attribute, or the whole event, action, entity or condition group
            that an element is part of.

    Raises:
        FileFormatError: missing, unreadable, not well-formed, hostile, malformed; all that is
            wrong at once (at most 50 problems).
        UnsupportedError: nothing is wrong but elements, attributes or versions that this version
            of BridgeGen cannot run; all of them, by name and line.
    """
    path = Path(source) if isinstance(source, str) else source
    place = place or (str(path) if isinstance(path, Path) else "document")
    root = parse_xml(path, place)
    if _tag(root) != "OpenSCENARIO":
        raise FileFormatError(
            f"{place}: the root element must be OpenSCENARIO, got {_tag(root)} (line 1)"
        )
    if (distribution := root.find(DISTRIBUTION)) is not None:
        named = distribution.find("ScenarioFile")
        file = "SCENARIO.xosc" if named is None else named.get("filepath", "")
        raise FileFormatError(
            f"{place}: is no scenario but says how the parameters of one vary; to search that: "
            f"bridgegen search {file} --distribution {place}"
        )
    scenario = verbatim(root, place, skipped, Reader.self_contained)
    if problems := parameters.problems(scenario):
        raise FileFormatError(*_shorten([f"{place}: {problem}" for problem in problems]))
    return scenario


def verbatim(
    root: etree._Element,
    place: str = "document",
    skipped: list[str] | None = None,
    reader_of: Callable[[], "Reader"] | None = None,
) -> OpenScenario:
    """Return a file's model as it stands there, with references to catalogues and local parameters.

    Args:
        root: of the document.
        place: what to call it in messages.
        skipped: as of `read`.
        reader_of: makes the reader.

    Raises:
        FileFormatError: as of `read`, but for parameters, which are not checked.
        UnsupportedError: as of `read`.
    """
    while True:
        reader = (reader_of or Reader)()
        scenario: Element | None = None
        with suppress(_EnoughError):
            scenario = reader.element(OpenScenario, root)
        if skipped is None or reader.malformed or not reader.unsupported:
            break
        skipped += [f"{place}: {text} (line {line})" for line, text in reader.unsupported]
        for node, name in reader.culprits:
            prune(node, name)
    reader.raise_problems(place)
    scenario = cast(OpenScenario, scenario)
    _check_version(scenario, place)
    return scenario


def _check_version(scenario: OpenScenario, place: str) -> None:
    header = scenario.file_header
    version = f"{header.rev_major}.{header.rev_minor}"
    if version not in VERSIONS:
        raise UnsupportedError(
            f"{place}: FileHeader must state a version of {', '.join(VERSIONS)}, got {version} "
            f"(line {header.line})"
        )


def _shorten(problems: list[str]) -> list[str]:
    more = len(problems) - MAX_PROBLEMS
    if more <= 0:
        return problems
    least = "at least " if len(problems) == _ENOUGH else ""
    return [*problems[:MAX_PROBLEMS], f"… and {least}{more} more problems"]


class _EnoughError(Exception):
    """There are more problems than anybody wants to know."""


@dataclass
class Reader:
    """Turns XML elements into model elements and collects what is wrong with them."""

    malformed: list[tuple[int, str]] = field(default_factory=list)
    unsupported: list[tuple[int, str]] = field(default_factory=list)
    culprits: list[tuple[etree._Element, str | None]] = field(default_factory=list)
    refused: frozenset[type[Element]] = frozenset()

    @classmethod
    def self_contained(cls) -> "Reader":
        """Return one that refuses what refers to catalogues or to parameters of its own."""
        return cls(refused=frozenset({CatalogReference}))

    def raise_problems(self, place: str) -> None:
        """Raise one error with all problems in the order of the file, if there are any."""
        problems = sorted(self.malformed + self.unsupported, key=lambda problem: problem[0])
        if problems:
            error = FileFormatError if self.malformed else UnsupportedError
            texts = [f"{place}: {text} (line {line})" for line, text in problems]
            raise error(*_shorten(texts))

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
            if attribute.required and attribute.name not in node.attrib:
                self.wrong(node, f"{_tag(node)} must have the attribute {attribute.name}")
        return values

    def _children(self, declared: Declaration, node: etree._Element) -> dict[str, Any]:
        found: dict[str, list[Element | None]] = {child.field: [] for child in declared.children}
        complete = True
        for sub in node:
            tag = _tag(sub)
            child = declared.by_tag.get(tag)
            local = tag == _LOCAL and _tag(node) != "OpenSCENARIO"
            if local and self.refused and not len(sub):
                continue
            if child is None or (self.refused and local) or child.options[tag] in self.refused:
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
    value = parse_value(attribute.kind, text)
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
