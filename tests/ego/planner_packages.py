"""Planners as an installed package would add them, for the tests."""

from bridgegen.ego.planners.planner import Planner

HERE = "planner_packages"


def made(name: str, driver: str, **changes: object) -> Planner:
    given = {
        "description": "Drives in tests.",
        "requires": ("numpy>=2",),
        "licence": "MIT",
        "source": "tests",
        "domain": frozenset({"motorway", "road"}),
    }
    return Planner(name=name, spec=f"drivers:{driver}", **{**given, **changes})


CRUISES = made("house:cruises", "Cruises")
RAISES = made("raises", "Raises")
ABSENT = made(
    "absent", "Cruises", requires=("no-such-planner>=1.0,<2",), how_to_get="It needs a checkout."
)
OLD = made("old", "Cruises", requires=("numpy<1.0",))
LOST = made("lost", "Cruises", domain=frozenset({"sea"}))
OTHER = made("another", "Cruises")
NO_PLANNER = 1

POINTS = {
    "house:cruises": "CRUISES", "raises": "RAISES", "absent": "ABSENT", "old": "OLD",
}  # fmt: skip
