"""Validation of a file: all of its problems at once.

Each kind of file imports what checks it: a map needs neither the simulator nor the ontology.
"""

from pathlib import Path

from bridgegen.errors import BridgeGenError, InputError
from bridgegen.ontology import reasoner
from bridgegen.ontology.graph import Individuals
from bridgegen.openx.opendrive import read as opendrive_read
from bridgegen.openx.opendrive import validate as opendrive_validate


def validate_file(
    path: Path, *, reason: bool = False, warnings: list[str] | None = None
) -> list[str]:
    """Return the problems of an ``.owl``, ``.xodr``, ``.xosc`` or ``.yaml`` file.

    An ``.owl`` of a scenario of the catalogue is checked against that scenario's constraints. An
    ``.xosc`` is checked with the map that it names, one with a distribution with its scenario. A
    ``.yaml`` is read; it is built, checked and simulated at its defaults and at the corners of its
    ranges, with its effects; its exposure is checked, or a file with one.

    Args:
        path: the file.
        reason: run the reasoner on an ``.owl``, too, for consistency.
        warnings: takes what is odd about an ``.xodr`` or ``.xosc`` that can be imported, searched
            or simulated all the same; by default, that is a problem, too.

    Raises:
        InputError: a file of another kind, or the reasoner is not installed.
    """
    if reason:
        reasoner.require()
    kinds = {
        ".owl": _ontology,
        ".xodr": lambda file: _roads(file, warnings),
        ".xosc": lambda file: _storyboard(file, warnings),
        ".yaml": _logical,
        ".yml": _logical,
    }
    if path.suffix.lower() not in kinds:
        raise InputError(f"{path}: the file's name must end in {', '.join(kinds)}")
    try:
        found = kinds[path.suffix.lower()](path)
        if reason and path.suffix.lower() == ".owl":
            found += reasoner.reason(path).problems
        return [_placed(path, problem) for problem in found]
    except BridgeGenError as error:
        return [_placed(path, problem) for problem in error.problems]


def name_note(path: Path) -> str | None:
    """Return what is odd about a valid scenario file's name; None where nothing is."""
    if path.suffix.lower() not in (".yaml", ".yml"):
        return None
    from bridgegen.exposure.reader import is_exposure
    from bridgegen.odd.reader import load as load_scenario
    from bridgegen.odd.reader import read_document

    if is_exposure(read_document(path)):
        return None
    name = load_scenario(path).name
    if name == path.stem:
        return None
    return (
        f"{path}: its key 'scenario' is '{name}', which names its runs; the file is called "
        f"'{path.stem}'"
    )


def _placed(path: Path, problem: str) -> str:
    return problem if str(path) in problem else f"{path}: {problem}"


def _ontology(path: Path) -> list[str]:
    from bridgegen.ontology.check import check
    from bridgegen.ontology.files import load
    from bridgegen.openx.convert import scenario_of

    individuals = load(path)
    if _is_map(individuals) or _is_mined(individuals):
        return [str(one) for one in check(individuals)]
    individuals.text(individuals.one("Scenario"), "has_name")  # all of ours have one
    return [str(one) for one in check(individuals, scenario_of(individuals))]


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
    model = opendrive_read.read(path, warnings=odd)
    odd += [_placed(path, problem) for problem in opendrive_validate.problems(model)]
    if warnings is None:
        return odd
    warnings += odd
    return []


def _storyboard(path: Path, warnings: list[str] | None) -> list[str]:
    from bridgegen.openx.file_scenario import load_file_scenario
    from bridgegen.openx.logic_file import roads_of
    from bridgegen.openx.openscenario import read as openscenario_read
    from bridgegen.openx.openscenario import validate as openscenario_validate
    from bridgegen.openx.openscenario.distributions import is_distribution, read_distribution

    if is_distribution(path):
        named = read_distribution(path).scenario_file.filepath
        notes = load_file_scenario(path.parent / str(named), path).notes
        if warnings is None:
            return list(notes)
        warnings += notes
        return []
    odd: list[str] = []
    scenario = openscenario_read.read(path, warnings=odd)
    problems = openscenario_validate.problems(scenario, roads_of(scenario, path))
    if warnings is None:
        return [*odd, *problems]
    warnings += odd
    return problems


def _logical(path: Path) -> list[str]:
    from bridgegen.campaign.exportable import CHECKED_BY_VALIDATE, require_exportable
    from bridgegen.exposure.reader import exposure_of, is_exposure, read_exposure
    from bridgegen.odd.reader import load as load_scenario
    from bridgegen.odd.reader import read_document
    from bridgegen.pipeline import Pipeline

    if is_exposure(read_document(path)):
        read_exposure(path)
        return []
    scenario = load_scenario(path)
    exposure_of(scenario)
    pipeline = Pipeline(scenario, scenario.space())  # builds and compiles it at the defaults
    require_exportable(pipeline, CHECKED_BY_VALIDATE)
    return []
