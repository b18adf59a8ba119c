"""Validation of a file: all of its problems at once.

Each kind of file imports what checks it: a map needs neither the simulator nor the ontology.
"""

import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from bridgegen.base.errors import BridgeGenError, InputError, UnsupportedError
from bridgegen.openx.opendrive import read as opendrive_read
from bridgegen.openx.opendrive import validate as opendrive_validate
from bridgegen.openx.opendrive.road_map import map_bytes
from bridgegen.openx.openscenario.tier4 import is_storyboard
from bridgegen.scenario.ontology import reasoner
from bridgegen.scenario.ontology.graph import Individuals

if TYPE_CHECKING:
    from bridgegen.scenario.language.story import EventSpec

PLACEHOLDERS = (
    "What happens, in a sentence or two.",
    "Where it comes from: a standard, an accident database, a drive.",
    "Why these limits?",
)
"""Texts of the template (language/starter.yaml) that say nothing about a scenario."""


def validate_file(
    path: Path, *, reason: bool = False, warnings: list[str] | None = None
) -> list[str]:
    """Return the problems of a file: ``.owl``, ``.xodr``, ``.osm``, ``.osc``, ``.xosc``, ``.yaml``.

    An ``.owl`` of a scenario of the catalogue is checked against that scenario's constraints. An
    ``.xosc`` is checked with the map that it names, one with a distribution with its scenario. A
    ``.yaml`` is read; it is built, checked and simulated at its defaults and at the corners of its
    ranges, with its effects; its exposure is checked, or a file with one.

    Args:
        path: the file.
        reason: run the reasoner on an ``.owl``, too, for consistency.
        warnings: takes what is odd about an ``.xodr`` or ``.xosc`` that can be imported, searched
            or simulated all the same, and why an ``.osc`` in good order cannot be searched; by
            default, that is a problem, too.

    Raises:
        InputError: a file of another kind, or the reasoner is not installed.
    """
    if reason:
        reasoner.require()
    kinds = {
        ".owl": _ontology,
        ".xodr": lambda file: _roads(file, warnings),
        ".osm": lambda file: _roads(file, warnings),
        ".osc": lambda file: _dsl(file, warnings),
        ".xosc": lambda file: _storyboard(file, warnings),
        ".yaml": _logical,
        ".yml": _logical,
    }
    if path.suffix.lower() not in kinds:
        raise InputError(f"{path}: the file's name must end in {', '.join(kinds)}")
    kind = ".xosc" if is_storyboard(path) else path.suffix.lower()
    try:
        found = kinds[kind](path)
        if reason and path.suffix.lower() == ".owl":
            found += reasoner.reason(path).problems
        return [_placed(path, problem) for problem in found]
    except BridgeGenError as error:
        return [_placed(path, problem) for problem in error.problems]


def notes_on(path: Path) -> list[str]:
    """Return what is odd about a valid scenario file; empty for a file of another kind.

    That its name is not the scenario's, that texts of the template still stand in it, and that a
    participant indicates to one side only and changes lane to the other only.
    """
    if path.suffix.lower() not in (".yaml", ".yml", ".osc") or is_storyboard(path):
        return []
    from bridgegen.scenario.exposure.reader import is_exposure
    from bridgegen.scenario.language.reader import load as load_scenario
    from bridgegen.scenario.language.reader import read_document

    if path.suffix.lower() == ".osc":
        with suppress(UnsupportedError):  # a warning already
            return list(load_scenario(path).notes)
        return []
    if is_exposure(read_document(path)):
        return []
    scenario = load_scenario(path)
    notes = []
    if scenario.name != path.stem:
        notes.append(
            f"its key 'scenario' is '{scenario.name}', which names its runs; the file is called "
            f"'{path.stem}'"
        )
    if count := len(re.findall("|".join(map(re.escape, PLACEHOLDERS)), path.read_text("utf-8"))):
        notes.append(
            f"texts of the template that its author is to replace: {count} (description, source)"
        )
    return [f"{path}: {note}" for note in (*notes, *_misleading_indicators(scenario.events))]


def _misleading_indicators(events: "Sequence[EventSpec]") -> Iterator[str]:
    """Yield a note for each participant whose indicators contradict its lane changes."""
    from bridgegen.scenario.language.story import Indication, LaneChange

    for actor in dict.fromkeys(event.participant for event in events):
        actions = [act for event in events if event.participant == actor for act in event.actions]
        shown = {act.side for act in actions if isinstance(act, Indication)} & {"left", "right"}
        taken = {
            "left" if act.lanes > 0 else "right" for act in actions if isinstance(act, LaneChange)
        }
        if shown and taken and not shown & taken:
            yield f"{actor} indicates to the {shown.pop()} and changes lane to the {taken.pop()}"


def _placed(path: Path, problem: str) -> str:
    return problem if str(path) in problem else f"{path}: {problem}"


def _ontology(path: Path) -> list[str]:
    from bridgegen.openx.convert import scenario_of
    from bridgegen.scenario.ontology.check import check
    from bridgegen.scenario.ontology.files import load

    individuals = load(path)
    if _is_map(individuals) or _is_mined(individuals):
        return [str(violation) for violation in check(individuals)]
    individuals.text(individuals.one("Scenario"), "has_name")  # all of ours have one
    return [str(violation) for violation in check(individuals, scenario_of(individuals))]


def _is_map(individuals: Individuals) -> bool:
    """Return whether these are a map without a scenario, as `import_file` writes."""
    return not individuals.of_class("Scenario") and any(
        individuals.optional_text(network, "has_map_file") is not None
        for network in individuals.of_class("RoadNetwork")
    )


def _is_mined(individuals: Individuals) -> bool:
    """Return whether these are mined scenarios and their statistics."""
    return bool(not individuals.of_class("Scenario") and individuals.of_class("MinedScenario"))


def _roads(path: Path, warnings: list[str] | None) -> list[str]:
    odd: list[str] = []
    model = opendrive_read.read(map_bytes(path, odd), str(path), odd)
    odd += [_placed(path, problem) for problem in opendrive_validate.problems(model)]
    if warnings is None:
        return odd
    warnings += odd
    return []


def _storyboard(path: Path, warnings: list[str] | None) -> list[str]:
    from bridgegen.openx.file_scenario import load_file_scenario
    from bridgegen.openx.opendrive.mirror import as_written
    from bridgegen.openx.openscenario import read as openscenario_read
    from bridgegen.openx.openscenario import validate as openscenario_validate
    from bridgegen.openx.openscenario.distributions import is_distribution, read_distribution
    from bridgegen.openx.prepared import roads_of

    if is_distribution(path):
        named = read_distribution(path).scenario_file.filepath
        notes = load_file_scenario(path.parent / str(named), path).notes
        if warnings is None:
            return list(notes)
        warnings += notes
        return []
    odd: list[str] = []
    scenario = openscenario_read.read(path, warnings=odd)
    problems = openscenario_validate.problems(scenario, as_written(roads_of(scenario, path)))
    if warnings is None:
        return [*odd, *problems]
    warnings += odd
    return problems


def _dsl(path: Path, warnings: list[str] | None) -> list[str]:
    from bridgegen.scenario.language.dsl.names import Names

    Names(path).stop()
    try:
        return _logical(path)
    except UnsupportedError as error:  # in good order, but nothing that can be searched
        if warnings is None:
            raise
        warnings += [f"it cannot be searched: {problem}" for problem in error.problems]
        return []


def _logical(path: Path) -> list[str]:
    from bridgegen.engine.pipeline import Pipeline
    from bridgegen.jobs.search.exportable import CHECKED_BY_VALIDATE, require_exportable
    from bridgegen.scenario.exposure.reader import exposure_of, is_exposure, read_exposure
    from bridgegen.scenario.language.reader import load as load_scenario
    from bridgegen.scenario.language.reader import read_document

    if path.suffix.lower() != ".osc" and is_exposure(read_document(path)):
        read_exposure(path)
        return []
    scenario = load_scenario(path)
    exposure_of(scenario)
    pipeline = Pipeline(scenario, scenario.space())  # builds and compiles it at the defaults
    require_exportable(pipeline, CHECKED_BY_VALIDATE)
    return []
