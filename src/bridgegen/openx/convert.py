"""Files in, files out: ontologies to OpenDRIVE and OpenSCENARIO and back, checks."""

import os
from pathlib import Path

from bridgegen.base.errors import InputError, StorageError
from bridgegen.openx.opendrive import read as opendrive_read
from bridgegen.openx.opendrive import write as opendrive_write
from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.road_map import digest_of, map_bytes, map_path
from bridgegen.openx.opendrive.to_owl import individuals_from_opendrive
from bridgegen.openx.opendrive.to_owl.network import losses
from bridgegen.openx.openscenario import read as openscenario_read
from bridgegen.openx.openscenario import write as openscenario_write
from bridgegen.openx.openscenario.from_owl.scenario import openscenario_from_owl
from bridgegen.openx.openscenario.parameters import EGO, ego_of, rename_entity
from bridgegen.openx.openscenario.pruning import NEVER, read_empty_triggers
from bridgegen.openx.openscenario.tier4 import is_storyboard
from bridgegen.openx.openscenario.to_owl import individuals_from_openscenario
from bridgegen.openx.prepared import logic_path, prepared, roads_of
from bridgegen.scenario.language.reader import entry_names, pack_names
from bridgegen.scenario.language.reader import load as load_scenario
from bridgegen.scenario.language.reader import names as scenario_names
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.ontology.check import check
from bridgegen.scenario.ontology.files import load, save
from bridgegen.scenario.ontology.graph import Individuals


def convert_file(owl: Path, folder: Path | None = None) -> tuple[list[Path], list[str]]:
    """Write the ``.xodr`` and ``.xosc`` of a scenario's ontology.

    Args:
        owl: the ontology with its individuals, as written or edited.
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
    return [road, scenario], [str(violation) for violation in check(individuals)]


def road_bytes(individuals: Individuals, beside: Path) -> bytes:
    """Return the OpenDRIVE file of a scenario: the map that it names, or OWL2OpenDRIVE's."""
    network = individuals.one("RoadNetwork")
    map_file = individuals.optional_text(network, "has_map_file")
    if map_file is None:
        return opendrive_write.to_xml(opendrive_from_owl(individuals))
    return map_bytes(beside / map_file)


def import_file(
    file: Path,
    out: Path | None = None,
    *,
    partial: bool = False,
    ego: str | None = None,
    strict: bool = False,
    empty_trigger: str = NEVER,
) -> tuple[Path, list[str]]:
    """Write a whole OpenDRIVE map, or a scenario file on its map, as an ontology.

    Of other people's scenario files, details are left out on which nothing depends that happens
    (names of models, wheels, controllers that are not known here, …), and an expression is stated
    by the value that it has. What else it has no words for is kept in OpenSCENARIO's own; what can
    be kept in neither is refused.

    Args:
        file: the map (``.xodr``, or by CARLA's name), or the scenario (``.xosc``), which
            references its map.
        out: the file to write, new; beside the first by default.
        partial: leave out contents that the ontology cannot express, instead of refusing the file.
        ego: of a scenario, the entity under test; the one called so by default, else the first.
        strict: take every detail of a scenario for one that must not be lost.
        empty_trigger: when acts and events start whose StartTrigger is empty: "never", or "now".

    Returns:
        The file written, and a sentence for each content that it lacks, or has in part.

    Raises:
        FileFormatError: not a file that can be read.
        InputError: there is no such entity, or a map has any.
        UnsupportedError: it uses what this version, or the ontology, cannot represent.
        StorageError: the file exists, or cannot be written.
    """
    named, file = file, map_path(file)
    out = out or (file if file == named else Path(named.name)).with_suffix(".owl")
    notes: list[str] = []
    if is_storyboard(file):
        individuals, notes = _import_storyboard(file, out, partial, ego, strict, empty_trigger)
    elif partial or strict or ego is not None or empty_trigger != NEVER:
        raise InputError(
            f"{file}: only a scenario (.xosc) can be imported in part or strictly, or has an ego "
            "or triggers"
        )
    else:
        data = map_bytes(file, notes)
        model = opendrive_read.read(data, str(file), notes)
        individuals = individuals_from_opendrive(model, _seen_from(out, file), digest_of(data))
        notes += losses(model)
    # An ontology may have been edited by hand, which a second import must not undo.
    if out.exists():
        raise StorageError(f"{out}: exists already, and is not overwritten")
    save(individuals, out)
    return out, notes


def _import_storyboard(
    file: Path, out: Path, partial: bool, ego: str | None, strict: bool, empty_trigger: str
) -> tuple[Individuals, list[str]]:
    skipped: list[str] = []
    scenario = openscenario_read.read(file, skipped=skipped if partial else None)
    notes: list[str] = []
    if ego is None and scenario.entities.scenario_objects:
        ego = ego_of(scenario)
        if ego.lower() != EGO:
            notes.append(f"{file}: {ego}, the first entity, is the ego; --ego chooses another")
    if ego is not None:
        scenario = rename_entity(scenario, ego, EGO)
    scenario = read_empty_triggers(scenario, empty_trigger)
    roads = roads_of(scenario, file)
    scenario = prepared(scenario, roads, str(file))
    road_map = logic_path(scenario, file)
    individuals, lost = individuals_from_openscenario(
        scenario,
        roads,
        _seen_from(out, road_map),
        str(file),
        partial=partial,
        in_substance=not strict,
    )
    return individuals, notes + [f"left out: {sentence}" for sentence in (*skipped, *lost)]


def _seen_from(out: Path, file: Path) -> str:
    return Path(os.path.relpath(file, out.parent)).as_posix()


def scenario_of(individuals: Individuals) -> LogicalScenario | None:
    """Return the scenario of the catalogue or of a pack that individuals refer to; None if none."""
    said = {
        name
        for node in individuals.of_class("Scenario")
        for name in individuals.texts(node, "has_name")
    }
    shipped = {name: name for name in scenario_names()}
    shipped |= {name.replace("/", "-"): name for name in (*pack_names(), *entry_names())}
    known = said.intersection(shipped)
    return load_scenario(shipped[known.pop()]) if len(said) == len(known) == 1 else None
