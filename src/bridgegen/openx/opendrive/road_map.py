"""A map that was made elsewhere: its bytes, model and place; and CARLA's maps by name."""

import hashlib
import os
from dataclasses import dataclass, replace
from pathlib import Path

from bridgegen.base.errors import FileFormatError
from bridgegen.openx.opendrive.mirror import right_hand
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.read import read
from bridgegen.openx.opendrive.site import find_site
from bridgegen.openx.opendrive.site_fit import ALL, BEST, alike, fitting_sites, site_for
from bridgegen.openx.xml import read_bytes
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.ontology.files import load
from bridgegen.scenario.ontology.site import Site

# --- Maps by CARLA's names, in the user's own CARLA ---


ROOT = "CARLA_ROOT"
"""The environment variable that says where CARLA is installed, or a folder with its maps."""

_PLACES = (
    "{name}.xodr",
    "*/Content/Carla/Maps/OpenDrive/{name}.xodr",
    "*/Content/Carla/Maps/{name}/OpenDrive/{name}.xodr",
)
"""Places of a map below the root: in a folder of maps; packaged, a large map's in its own."""


def map_path(path: Path) -> Path:
    """Return the file of a map that is named as CARLA names it (``Town01``); a path as it is.

    Args:
        path: a file; or a name without a suffix, which is looked for below ``CARLA_ROOT``, its
            folders apart (as ScenarioRunner's files name a map: ``Carla/Maps/Town01``).

    Raises:
        FileFormatError: there is no such file, and the name is not found.
    """
    if path.suffix or path.exists():
        return path
    root = os.environ.get(ROOT)
    rule = f"{path}: neither a file nor the name of a map of CARLA"
    if not root:
        raise FileFormatError(f"{rule}, as neither --maps nor {ROOT} says where CARLA is")
    # The name becomes part of a glob, and it may come from a scenario file: with ``..`` or ``*`` it
    # would name any file.
    if not all(name.isalnum() or name in "_-" for name in path.name):
        raise FileFormatError(f"{rule}, which has letters, digits, _ and - only")
    for place in _PLACES:
        # The order of a glob is the file system's; sorted, every machine takes the same map.
        found = sorted(Path(root).glob(place.format(name=path.name)))
        if found:
            return found[0]
    raise FileFormatError(f"{rule} in {root} (--maps, or {ROOT})")


def map_bytes(path: Path, warnings: list[str] | None = None) -> bytes:
    """Return a map as OpenDRIVE: its own bytes, or those that a Lanelet2 map (``.osm``) becomes.

    Args:
        path: an OpenDRIVE file, or a Lanelet2 map.
        warnings: takes a sentence for each kind of thing that OpenDRIVE does not get.

    Raises:
        FileFormatError: it cannot be read; a Lanelet2 map that cannot be.
    """
    data = read_bytes(path)
    if path.suffix.lower() != ".osm":
        return data
    from bridgegen.openx.lanelet2.convert import opendrive_of

    return opendrive_of(data, str(path), warnings)


@dataclass(frozen=True)
class RoadMap:
    """An OpenDRIVE file and where on it scenarios take place.

    Attributes:
        path: of the file; with the ending of OpenDRIVE.
        data: of OpenDRIVE, exported unchanged.
        model: its contents, mirrored where traffic drives on the left.
        site: the junction or the stretch of road.
        warnings: what was not read as it stands.
        sites: all that are searched together, the site first; empty where it is alone.
        others: what else may be taken instead of the site, that most alike first.
    """

    path: Path
    data: bytes
    model: OpenDrive
    site: Site
    warnings: tuple[str, ...] = ()
    sites: tuple[Site, ...] = ()
    others: tuple[Site, ...] = ()

    def at(self, site: Site) -> "RoadMap":
        """Return the map with one of its places alone."""
        return replace(self, site=site, sites=(), others=())


def load_map(
    path: Path, junction: str | None = None, scenario: LogicalScenario | None = None
) -> RoadMap:
    """Read a map and find the place on it that a scenario takes place at.

    Args:
        path: an OpenDRIVE file (or a map of CARLA's by its name), or the ``.owl`` that
            ``bridgegen ontology import`` made of one: the file that it names is read then, which
            must be what it was.
        junction: the id of the junction, or of the stretch of road; where the map has several,
            it must be named, or "best": the one that fits the scenario and is most like its own;
            or "all": each that fits, at each rotation of its legs.
        scenario: what takes place there; a usual crossroads' legs are looked for by default.

    Raises:
        FileFormatError: missing, unreadable, malformed or inconsistent; an ``.owl`` that names no
            map, or one that is missing or has changed.
        UnsupportedError: the place has not the legs, or the lanes, of the scenario.
        InputError: the choice of the place is open.
    """
    path = map_path(path)
    owl = path if path.suffix.lower() == ".owl" else None
    digest = ""
    if owl is not None:
        path, digest = map_of(owl)
    warnings: list[str] = []
    data = map_bytes(path, warnings) if owl is None else _read_named(path, owl, warnings)
    # The individuals hold neither elevations nor the course of cubics; these are in the map alone.
    # A scenario that is searched on the ontology takes place on exactly the file it was made of.
    if owl is not None and digest_of(data) != digest:
        raise FileFormatError(
            f"{owl}: its map {path} must be what it was when it was imported, but has changed; "
            "import it again"
        )
    model = right_hand(read(data, str(path), warnings), str(path))
    path = as_opendrive(path)
    sites: list[Site] = []
    others: list[Site] = []
    if scenario is not None and junction == ALL:
        sites = fitting_sites(scenario, model, path.name)
        site = sites[0]
    elif scenario is not None and junction == BEST:
        site, *others = alike(scenario, fitting_sites(scenario, model, path.name))
    elif scenario is None:
        site = find_site(model, junction, map_name=path.name)
    else:
        site = site_for(scenario, model, junction, path.name)
    together = tuple(sites) if len(sites) > 1 else ()
    return RoadMap(path, data, model, site, tuple(warnings), together, tuple(others))


def map_of(owl: Path) -> tuple[Path, str]:
    """Return the map that an import was made of, and its digest.

    Raises:
        FileFormatError: not an ontology, or one that names no map or not what that was.
    """
    individuals = load(owl)
    networks = individuals.of_class("RoadNetwork")
    named = [
        (
            individuals.optional_text(network, "has_map_file"),
            individuals.optional_text(network, "has_map_digest"),
        )
        for network in networks
    ]
    if len(named) != 1 or named[0][0] is None or individuals.of_class("Scenario"):
        raise FileFormatError(
            f"{owl}: it must be a map that 'bridgegen ontology import' made individuals of, with "
            "the file that it was (has_map_file), and no scenario"
        )
    ((file, digest),) = named
    if digest is None:
        raise FileFormatError(
            f"{owl}: it must say what its map was when it was imported (has_map_digest), and does "
            "not; import it again"
        )
    return owl.parent / str(file), digest


def digest_of(data: bytes) -> str:
    """Return the SHA-256 of a file, in hexadecimal."""
    return hashlib.sha256(data).hexdigest()


def as_opendrive(path: Path) -> Path:
    """Return the name of a map when it is exported: of a Lanelet2 map, that of its OpenDRIVE."""
    return path.with_suffix(".xodr") if path.suffix.lower() == ".osm" else path


def _read_named(path: Path, owl: Path, warnings: list[str]) -> bytes:
    try:
        return map_bytes(path, warnings)
    except FileFormatError as error:
        raise FileFormatError(
            *(f"{owl}: its map must be there beside it: {problem}" for problem in error.problems)
        ) from None
