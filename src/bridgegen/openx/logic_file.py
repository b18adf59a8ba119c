"""The OpenDRIVE map that an OpenSCENARIO file names."""

from pathlib import Path

from bridgegen.base.errors import FileFormatError
from bridgegen.openx.opendrive import read as opendrive_read
from bridgegen.openx.opendrive.carla_maps import map_path
from bridgegen.openx.opendrive.model import Header, OpenDrive
from bridgegen.openx.openscenario import parameters
from bridgegen.openx.openscenario.model import OpenScenario
from bridgegen.openx.openscenario.values import ParameterRef


def roads_of(scenario: OpenScenario, path: Path) -> OpenDrive:
    """Read the map that a scenario file names; one without roads where it names none.

    Raises:
        FileFormatError: the map cannot be read.
    """
    if scenario.road_network.logic_file is None:
        return OpenDrive(Header(1, 7))
    return opendrive_read.read(logic_path(scenario, path), may_be_empty=True)


def logic_path(scenario: OpenScenario, path: Path) -> Path:
    """Return the file of the map that a scenario file names, by path or as CARLA's.

    Raises:
        FileFormatError: it names none, or one of CARLA's that is not found.
    """
    return map_path(path.parent / logic_file(scenario, path))


def logic_file(scenario: OpenScenario, path: Path) -> str:
    """Return the path of the map that a scenario file names, as it does.

    Raises:
        FileFormatError: it names none.
    """
    named = scenario.road_network.logic_file
    if named is None:
        raise FileFormatError(f"{path}: RoadNetwork needs a LogicFile, the OpenDRIVE map")
    if isinstance(named.filepath, ParameterRef):
        return str(parameters.values(scenario)[named.filepath.name])
    return named.filepath
