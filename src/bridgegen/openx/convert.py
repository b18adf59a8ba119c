"""Files in, files out: ontologies to OpenDRIVE and OpenSCENARIO, maps to ontologies, checks."""

import os
from pathlib import Path

from bridgegen.errors import BridgeGenError, FileFormatError, InputError, StorageError
from bridgegen.odd.reader import load as load_scenario
from bridgegen.odd.reader import names as scenario_names
from bridgegen.odd.scenario import LogicalScenario
from bridgegen.ontology import reasoner
from bridgegen.ontology.check import check
from bridgegen.ontology.files import load, save
from bridgegen.ontology.graph import Individuals
from bridgegen.openx.opendrive import read as opendrive_read
from bridgegen.openx.opendrive import validate as opendrive_validate
from bridgegen.openx.opendrive import write as opendrive_write
from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.map_losses import losses
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.road_map import digest_of
from bridgegen.openx.opendrive.to_owl import individuals_from_opendrive
from bridgegen.openx.openscenario import read as openscenario_read
from bridgegen.openx.openscenario import validate as openscenario_validate
from bridgegen.openx.openscenario import write as openscenario_write
from bridgegen.openx.openscenario.from_owl import openscenario_from_owl
from bridgegen.openx.openscenario.model import OpenScenario
from bridgegen.openx.xml import read_bytes


def convert_file(owl: Path, folder: Path | None = None) -> tuple[list[Path], list[str]]:
    """Write the ``.xodr`` and ``.xosc`` of a scenario's ontology.

    Args:
        owl: the ontology with its individuals, as written or as somebody edited it.
        folder: where to write; beside the ontology by default.

    Returns:
        The files written, and a sentence for each constraint that the individuals break: they
        are converted all the same, for a test may well mean to break one.

    Raises:
        FileFormatError: not an ontology that can be read.
        OntologyError: an individual lacks what a scenario needs.
        StorageError: the files cannot be written.
    """
    individuals = load(owl)
    folder = folder or owl.parent
    road = folder / f"{owl.stem}.xodr"
    scenario = folder / f"{owl.stem}.xosc"
    roads = road_bytes(individuals, owl.parent)
    storyboard = openscenario_write.to_xml(openscenario_from_owl(individuals, road.name))
    try:
        folder.mkdir(parents=True, exist_ok=True)
        road.write_bytes(roads)
        scenario.write_bytes(storyboard)
    except OSError as error:
        raise StorageError(f"{folder}: cannot be written: {error.strerror}") from None
    return [road, scenario], [str(one) for one in check(individuals)]


def road_bytes(individuals: Individuals, beside: Path) -> bytes:
    """Return the OpenDRIVE file of a scenario: the map that it names, or OWL2OpenDRIVE's."""
    network = individuals.one("RoadNetwork")
    map_file = individuals.optional_text(network, "has_map_file")
    if map_file is None:
        return opendrive_write.to_xml(opendrive_from_owl(individuals))
    return read_bytes(beside / map_file)


def import_file(road_map: Path, out: Path | None = None) -> tuple[Path, list[str]]:
    """Write a whole OpenDRIVE map as the static part of an ontology.

    Args:
        road_map: the map.
        out: the file to write, new; beside the map by default.

    Returns:
        The file written, and a sentence for each kind of thing that it does not say in full.

    Raises:
        FileFormatError: not a map that can be read.
        UnsupportedError: it uses what this version cannot represent.
        StorageError: the file exists, or cannot be written.
    """
    data = read_bytes(road_map)
    model = opendrive_read.read(data, str(road_map))
    out = out or road_map.with_suffix(".owl")
    if out.exists():
        raise StorageError(f"{out}: exists already, and is not overwritten")
    map_file = Path(os.path.relpath(road_map, out.parent)).as_posix()
    save(individuals_from_opendrive(model, map_file, digest_of(data)), out)
    return out, list(losses(model))


def validate_file(path: Path, *, reason: bool = False) -> list[str]:
    """Return what is wrong with an ``.owl``, ``.xodr``, ``.xosc`` or ``.yaml`` file.

    An ``.owl`` of a scenario of the catalogue is held against that scenario's constraints. An
    ``.xosc`` is checked with the map that it names.

    Args:
        path: the file.
        reason: ask the reasoner about an ``.owl``, too: can the individuals be at all?

    Raises:
        InputError: a file of another kind, or a reasoner is asked for that is not installed.
    """
    if reason:
        reasoner.require()
    kinds = {
        ".owl": _ontology,
        ".xodr": _roads,
        ".xosc": _storyboard,
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


def _placed(path: Path, problem: str) -> str:
    return problem if str(path) in problem else f"{path}: {problem}"


def _ontology(path: Path) -> list[str]:
    individuals = load(path)
    if _is_map(individuals):
        return [str(one) for one in check(individuals)]
    individuals.text(individuals.one("Scenario"), "has_name")  # a file without is none of ours
    return [str(one) for one in check(individuals, scenario_of(individuals))]


def scenario_of(individuals: Individuals) -> LogicalScenario | None:
    """Return the scenario of the catalogue that individuals say they are of; None if of none."""
    said = {name for one in individuals.of_class("Scenario")
            for name in individuals.texts(one, "has_name")}  # fmt: skip
    known = said.intersection(scenario_names())
    return load_scenario(known.pop()) if len(said) == len(known) == 1 else None


def _is_map(individuals: Individuals) -> bool:
    """Say whether these are a map and no scenario: what `import_file` writes."""
    return not individuals.of_class("Scenario") and any(
        individuals.optional_text(network, "has_map_file") is not None
        for network in individuals.of_class("RoadNetwork")
    )


def _roads(path: Path) -> list[str]:
    return opendrive_validate.problems(opendrive_read.read(path))


def _storyboard(path: Path) -> list[str]:
    scenario = openscenario_read.read(path)
    return openscenario_validate.problems(scenario, roads_of(scenario, path))


def roads_of(scenario: OpenScenario, path: Path) -> OpenDrive:
    """Read the map that a scenario file names.

    Raises:
        FileFormatError: it names none, or the map cannot be read.
    """
    logic_file = scenario.road_network.logic_file
    if logic_file is None:
        raise FileFormatError(f"{path}: RoadNetwork needs a LogicFile, the OpenDRIVE map")
    return opendrive_read.read(path.parent / str(logic_file.filepath))


def _logical(path: Path) -> list[str]:
    load_scenario(path)
    return []
