"""From an OpenSCENARIO file to the model: a scenario that stands by itself."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from lxml import etree

from bridgegen.base.errors import FileFormatError, UnsupportedError
from bridgegen.openx.openscenario import parameters
from bridgegen.openx.openscenario.element import Element
from bridgegen.openx.openscenario.expand import expanded
from bridgegen.openx.openscenario.pruning import strays, without
from bridgegen.openx.openscenario.reader import element_of, shorten
from bridgegen.openx.openscenario.storyboard import OpenScenario
from bridgegen.openx.openscenario.tier4 import root_of
from bridgegen.openx.openscenario.write import fill
from bridgegen.openx.xml import parse_xml

VERSIONS = ("1.0", "1.1", "1.2", "1.3")
DISTRIBUTION = "ParameterValueDistribution"


def read(
    source: Path | str | bytes,
    place: str | None = None,
    *,
    skipped: list[str] | None = None,
    warnings: list[str] | None = None,
    texts: dict[str, str] | None = None,
) -> OpenScenario:
    """Read a scenario file of version 1.0 to 1.3.

    Children may stand in any order. What is elsewhere is put in its place (see
    `bridgegen.openx.openscenario.expand`): the entries of catalogues, the values of parameters that
    are not the whole scenario's, the members of selections. Parameters are checked: each is
    declared once, with a value of its type within its constraints, and what refers to it exists
    and fits.

    Args:
        source: a path, or the document itself as bytes, which then may refer to no catalogue.
        place: what to call it in messages; the path by default.
        skipped: takes a sentence for each thing that is not supported, which is left out then
            instead of refused: an attribute, or the whole event, action, entity or condition group
            that an element is part of.
        warnings: takes a sentence for each thing that is wrong and harms nothing: a parameter's
            value that is not of its type, and is a text then; a parameter that a catalogue's entry
            is given and does not have.
        texts: values of the scenario's own parameters of type string in place of the declared.

    Raises:
        FileFormatError: missing, unreadable, not well-formed, hostile, malformed; all that is
            wrong at once (at most 50 problems).
        UnsupportedError: nothing is wrong but elements, attributes or versions that this version
            of BridgeGen cannot run; all of them, by name and line.
    """
    path = Path(source) if isinstance(source, str) else source
    place = place or (str(path) if isinstance(path, Path) else "document")
    root = root_of(path, place, warnings)
    # Both kinds of file have the same root element, and users give one for the other.
    if (distribution := root.find(DISTRIBUTION)) is not None:
        named = distribution.find("ScenarioFile")
        its_own = "SCENARIO.xosc" if named is None else named.get("filepath", "")
        raise FileFormatError(
            f"{place}: is no scenario but says how the parameters of one vary; to search that: "
            f"bridgegen search {its_own} --distribution {place}"
        )
    file = _with_texts(verbatim(root, place, skipped, warnings), texts or {})
    folder = path.parent if isinstance(path, Path) else None
    scenario = expanded(file, folder, place, skipped, warnings)
    # Until nothing is astray: what names an entity that went goes with it, and may take others
    # along.
    while skipped is not None and (astray := strays(scenario)):
        skipped += [
            f"{place}: {type(element).__name__} of an entity that is not there (line "
            f"{element.line})"
            for element in astray
        ]
        scenario = without(scenario, astray)
    # Last, on the scenario as it stands by itself: catalogues may have brought references to
    # parameters.
    if problems := parameters.problems(scenario):
        raise FileFormatError(*shorten([f"{place}: {problem}" for problem in problems]))
    return scenario


def _with_texts(scenario: OpenScenario, texts: dict[str, str]) -> OpenScenario:
    """Return a file as it stands with other values of parameters that are texts."""
    declared = scenario.parameter_declarations
    if declared is None or not texts:
        return scenario
    parameters = tuple(
        replace(parameter, value=texts.get(parameter.name, parameter.value))
        for parameter in declared.parameters
    )
    return replace(scenario, parameter_declarations=replace(declared, parameters=parameters))


def verbatim(
    root: etree._Element,
    place: str = "document",
    skipped: list[str] | None = None,
    warnings: list[str] | None = None,
) -> OpenScenario:
    """Return a file's model as it stands there; parameters are not checked.

    Args:
        root: of the document.
        place: what to call it in messages.
        skipped: as of `read`.
        warnings: likewise.

    Raises:
        FileFormatError: as of `read`.
        UnsupportedError: as of `read`.
    """
    if root.tag != "OpenSCENARIO":
        raise FileFormatError(
            f"{place}: the root element must be OpenSCENARIO, got {root.tag!s} (line 1)"
        )
    if root.find("Catalog") is not None:
        raise FileFormatError(f"{place}: is a catalogue, and no scenario")
    scenario = element_of(OpenScenario, root, place, skipped, warnings)
    header = scenario.file_header
    version = f"{header.rev_major}.{header.rev_minor}"
    if version not in VERSIONS:
        raise UnsupportedError(
            f"{place}: FileHeader must state a version of {', '.join(VERSIONS)}, got {version} "
            f"(line {header.line})"
        )
    return scenario


# --- Single elements of OpenSCENARIO as text, as the ontology keeps them ---


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
