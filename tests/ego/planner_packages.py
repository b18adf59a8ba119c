"""Planners as an installed package would add them, for the tests."""

import numpy as np

from bridgegen.drivers.interface import Control
from bridgegen.drivers.planners import Planner


def made(name: str, driver: str, **changes: object) -> Planner:
    given = {
        "description": "Drives in tests.",
        "requires": ("numpy>=2",),
        "licence": "MIT",
        "source": "tests",
        "domain": frozenset({"motorway", "road"}),
    }
    return Planner(**{"name": name, "spec": f"drivers:{driver}", **given, **changes})


CRUISES = made("house:cruises", "Cruises")
RAISES = made("raises", "Raises")
ABSENT = made(
    "absent", "Cruises", requires=("no-such-planner>=1.0,<2",), how_to_get="It needs a checkout."
)
OLD = made("old", "Cruises", requires=("numpy<1.0",))
LOST = made("lost", "Cruises", domain=frozenset({"sea"}))
OTHER = made("another", "Cruises")
NO_PLANNER = 1

BLIND = made("blind", "Blind", spec="planner_packages:Blind", domain=frozenset({"motorway"}))
"""It may drive on motorways, and it ignores the others."""


class Blind:
    """Holds its speed along its route."""

    period = 0.5  # called rarely, it takes less time

    def reset(self, n, scene):
        self.n = n

    def act(self, observation):
        return Control(np.zeros(self.n), observation.route[:, 0, 3])


def export(observations, scene):
    """What the planner saw: one row for each call."""
    return {
        "time": np.array([one.time for one in observations]),
        "curvature": np.array([one.route[0, 0, 3] for one in observations]),
        "length": np.array(scene.length),
    }


def reproduction(observations_path):
    return (
        f"import numpy as np\n\nseen = np.load({observations_path!r})\nprint(len(seen['time']))\n"
    )
