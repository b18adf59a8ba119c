"""A storyboard and its map together: what a file leaves to the map, said outright."""

from bridgegen.openx.geo import on_plane
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.openscenario.model import OpenScenario
from bridgegen.openx.random_routes import with_random_routes
from bridgegen.openx.traffic import populated


def prepared(scenario: OpenScenario, roads: OpenDrive, place: str) -> OpenScenario:
    """Return a scenario without positions on the globe, traffic actions and random routes.

    Args:
        scenario: as read.
        roads: its map.
        place: what to call the scenario in messages.

    Raises:
        InputError: an extra is missing.
        FileFormatError: the map lacks what they need; by line.
    """
    whole = populated(on_plane(scenario, roads, place), roads, place)
    return with_random_routes(whole, roads, place)
