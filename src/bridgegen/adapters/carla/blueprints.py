"""Which of CARLA's models stands for which participant."""

from collections.abc import Collection

from bridgegen.base.errors import InputError
from bridgegen.drivers.kinds import NAMES
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.scenario_runner.blueprints import ranked
from bridgegen.scenario.participants import OBJECT_CLASSES


def choose(
    body: object, kind: int, size: tuple[float, float, float], known: Collection[str]
) -> str:
    """Return the blueprint for a participant: the one that it is named by, or the nearest in size.

    Args:
        body: its entry in the storyboard.
        kind: what it is, see `bridgegen.drivers.kinds`.
        size: length, width and height [m].
        known: the blueprints that the server has.

    Raises:
        InputError: it has none that would do.
    """
    named = str(getattr(body, "name", ""))
    alike = (
        ranked(body, size)
        if isinstance(body, osc.Vehicle | osc.Pedestrian | osc.MiscObject)
        else []
    )
    spare = OBJECT_CLASSES[kind].carla
    for one in (named, *alike, *spare):
        if one in known:
            return one
    raise InputError(
        f"carla: the server must have a blueprint for a {NAMES[kind]}, and has none of "
        f"{', '.join(dict.fromkeys((*alike, *spare)))}"
    )
