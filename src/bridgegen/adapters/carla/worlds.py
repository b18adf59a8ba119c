"""The world of the server: one of its maps, or one generated from OpenDRIVE."""

import hashlib
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import PurePosixPath
from typing import TYPE_CHECKING

from bridgegen.adapters.carla import frame
from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.write import to_xml

if TYPE_CHECKING:
    import carla

VERTEX_DISTANCE, LONGEST = 2.0, 500.0
"""Distance of two vertices of a road's mesh [m], and length of one piece of mesh [m]."""

NOWHERE = "+proj=tmerc +lat_0=0 +lon_0=0"
"""The geo-reference of roads without one: CARLA's default."""

ASTRAY = 1.5
"""Maximum distance of a route from the centre of the server's lane [m]; lane changes leave it."""


class Worlds:
    """The loaded world, and the key of its source."""

    def __init__(self) -> None:
        self._world: carla.World | None = None
        self._map: carla.Map | None = None
        self._key, self._id = "", -1

    @property
    def world(self) -> "carla.World":
        """The loaded world."""
        assert self._world is not None
        return self._world

    @property
    def map(self) -> "carla.Map":
        """Its roads as CARLA's map, read once per world."""
        if self._map is None:
            self._map = self.world.get_map()
        return self._map

    def take(self, world: "carla.World") -> None:
        """Use the world that the server has loaded."""
        self._world, self._map, self._key, self._id = world, None, "", world.id

    def forget(self) -> None:
        """Forget the loaded world."""
        self._key = ""

    def load(
        self,
        client: "carla.Client",
        make: Callable[["carla.Client"], "carla.World"],
        key: str,
    ) -> None:
        """Load a world, unless it is loaded already."""
        present = client.get_world()
        # The world's id, too: another client may have loaded another one meanwhile.
        if key != self._key or present.id != self._id:
            self.take(make(client))
            self._key = key


class Town:
    """A map of the server.

    Args:
        name: of it, without its folder.
    """

    def __init__(self, name: str) -> None:
        self.key = self.name = name

    def __call__(self, client: "carla.Client") -> "carla.World":
        """Load it."""
        return client.load_world(self.name)


class Generated:
    """A world generated from OpenDRIVE roads.

    Args:
        model: them.
    """

    name = "our roads"

    def __init__(self, model: OpenDrive) -> None:
        if model.header.geo_reference is None:  # CARLA complains on standard output
            header = replace(model.header, geo_reference=NOWHERE)
            model = replace(model, header=header)
        self._text = to_xml(model).decode()
        # By the text: rows with the same roads share a world.
        self.key = hashlib.sha256(self._text.encode()).hexdigest()

    def __call__(self, client: "carla.Client") -> "carla.World":
        """Have the server generate the world: a mesh of the road, no walls, no actors."""
        import carla

        return client.generate_opendrive_world(
            self._text,
            carla.OpendriveGenerationParameters(
                vertex_distance=VERTEX_DISTANCE,
                max_road_length=LONGEST,
                wall_height=0.0,
                additional_width=0.6,
                smooth_junctions=True,
                enable_mesh_visibility=True,
                enable_pedestrian_navigation=False,
            ),
        )


def loader(model: OpenDrive, file: str, wanted: str, known: list[str]) -> Town | Generated:
    """Return the loader of a scenario's roads.

    Args:
        model: them.
        file: the OpenDRIVE file that the storyboard names.
        wanted: the setting ``map``.
        known: the server's maps.

    Raises:
        UnknownNameError: a map by name that the server has not.
    """
    names = {PurePosixPath(item).name for item in known}
    if wanted not in ("auto", "opendrive"):
        if wanted not in names:
            raise UnknownNameError("map of the server", wanted, sorted(names))
        return Town(wanted)
    name = PurePosixPath(file.replace("\\", "/")).stem
    if wanted == "auto" and name in names:
        return Town(name)
    return Generated(model)


def check(roads: "carla.Map", way: Float, name: str) -> None:
    """Check that a route lies on lanes of the server's map.

    Args:
        roads: the server's.
        way: ``(n, 2)`` x, y [m] of the route.
        name: the map's, for the message.

    Raises:
        InputError: it is not.
    """
    # CARLA reads broken or other maps without a word, so the route is looked at: some twenty points
    # tell whether it is the same map.
    for x, y in way[:: max(len(way) // 20, 1)].tolist():
        spot = frame.location(x, y)
        waypoint = roads.get_waypoint(spot, True)
        off = (
            None
            if waypoint is None
            else math.dist(frame.point(waypoint.transform.location), (x, y))
        )
        if off is None or off > ASTRAY:
            raise InputError(
                f"carla: the ego's route must be on a lane of {name} (within {ASTRAY:g} m of its "
                f"centre) at ({x:.1f}, {y:.1f}) m, and the server's nearest is "
                f"{'nowhere' if off is None else f'{off:.1f} m away'}: is it the same map? "
                "(--simulator-set map=opendrive has the server make our roads)"
            )
