"""A map that was made elsewhere: its bytes as they came, its model, and the chosen intersection."""

from dataclasses import dataclass
from pathlib import Path

from bridgegen.ontology.site import Site
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.read import read
from bridgegen.openx.opendrive.site import find_site
from bridgegen.openx.xml import read_bytes


@dataclass(frozen=True)
class RoadMap:
    """An OpenDRIVE file and where on it scenarios take place.

    Attributes:
        path: of the file.
        data: its bytes, handed over unchanged.
        model: what it says.
        site: the intersection.
    """

    path: Path
    data: bytes
    model: OpenDrive
    site: Site


def load_map(path: Path, junction: str | None = None) -> RoadMap:
    """Read a map and find an intersection of four legs on it.

    Args:
        path: an OpenDRIVE file.
        junction: the id of the junction; where the map has several, it must be named.

    Raises:
        FileFormatError: missing, unreadable, malformed or inconsistent.
        UnsupportedError: the junction has not four legs.
        InputError: the choice of the junction is open.
    """
    data = read_bytes(path)
    model = read(data, str(path))
    return RoadMap(path, data, model, find_site(model, junction, map_name=path.name))
