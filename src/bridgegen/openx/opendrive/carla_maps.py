"""Maps by CARLA's names, in the user's own CARLA."""

import os
from pathlib import Path

from bridgegen.base.errors import FileFormatError

ROOT = "CARLA_ROOT"
"""The environment variable that says where CARLA is installed, or a folder with its maps."""

_PLACES = (
    "{name}.xodr",
    "*/Content/Carla/Maps/OpenDrive/{name}.xodr",
    "*/Content/Carla/Maps/{name}/OpenDrive/{name}.xodr",
)
"""Where a map lies below the root: in a folder of maps; packaged, a large map's in its own."""


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
    if not all(one.isalnum() or one in "_-" for one in path.name):
        raise FileFormatError(f"{rule}, which has letters, digits, _ and - only")
    for place in _PLACES:
        found = sorted(Path(root).glob(place.format(name=path.name)))
        if found:
            return found[0]
    raise FileFormatError(f"{rule} in {root} (--maps, or {ROOT})")
