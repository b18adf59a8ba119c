"""Road networks to test with: Town05 where it is at hand, and crossroads over their whole range."""

import itertools
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Literal

import pytest
from hypothesis import strategies as st

from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.read import read
from bridgegen.scenario.ontology.individuals import build_static
from bridgegen.scenario.ontology.site import ArmRoad, Leg, Site, SiteLane

Values = Mapping[str, float]


def values(width: float, lanes: int, arm: float, size: float) -> Values:
    return {
        "lane_width": width,
        "lanes_per_direction": lanes,
        "arm_length": arm,
        "intersection_size": size,
    }


def least_size(width: float, lanes: int) -> float:
    return max(16.0, 2 * lanes * width + 6.0)


@pytest.fixture(scope="session")
def crossroads() -> Callable[..., OpenDrive]:
    """Make a crossroads of four equal legs by way of its individuals."""

    def make(
        width: float = 3.5, lanes: int = 2, arm: float = 60.0, size: float = 26.0
    ) -> OpenDrive:
        return opendrive_from_owl(build_static(values(width, lanes, arm, size)))

    return make


@pytest.fixture(scope="session")
def corners() -> list[Values]:
    """The corners of the static parameters' range."""
    return [
        values(width, lanes, arm, size)
        for width, lanes, arm in itertools.product((2.75, 4.0), (1, 2, 3), (45.0, 100.0))
        for size in (least_size(width, lanes), 44.0)
    ]


@pytest.fixture(scope="session")
def static() -> st.SearchStrategy[Values]:
    """Any static parameters within their range and bounds."""

    @st.composite
    def draw(pick: st.DrawFn) -> Values:
        width, lanes = pick(st.floats(2.75, 4.0)), pick(st.integers(1, 3))
        size = pick(st.floats(least_size(width, lanes), 44.0))
        return values(width, lanes, pick(st.floats(45.0, 100.0)), size)

    return draw()


@pytest.fixture(scope="session")
def sites() -> st.SearchStrategy[Site]:
    """Four legs at any headings at least 45° apart, with lanes and widths of any kind."""
    widths = st.lists(st.floats(2.75, 4.0), min_size=1, max_size=3)

    @st.composite
    def leg(pick: st.DrawFn, number: int, heading: float) -> Leg:
        end: Literal["start", "end"] = pick(st.sampled_from(("start", "end")))
        side = 1 if end == "start" else -1
        lanes = [SiteLane(side * k, "in", width) for k, width in enumerate(pick(widths), 1)]
        lanes += [SiteLane(-side * k, "out", width) for k, width in enumerate(pick(widths), 1)]
        road_id = str(number * pick(st.sampled_from((1, 7))))
        road = ArmRoad(road_id, pick(st.floats(45.0, 100.0)), end, tuple(lanes), 13.9)
        return Leg("ABCD"[number - 1], heading, (road,))

    @st.composite
    def site(pick: st.DrawFn) -> Site:
        gaps = pick(st.lists(st.floats(0.0, 1.0), min_size=4, max_size=4))
        total = sum(gaps)
        heading, legs = pick(st.floats(-360.0, 0.0)), []
        for number, gap in enumerate(gaps, start=1):
            legs.append(pick(leg(number, heading)))
            heading += 45.0 + (180.0 * gap / total if total > 0.1 else 45.0)
        junction_id = pick(st.sampled_from(("100", "5", "999999")))
        return Site("crossing", None, junction_id, 90.0, tuple(pick(st.permutations(legs))))

    return site()


@pytest.fixture(scope="session")
def town05_path() -> Path:
    """CARLA's Town05: it is not part of the repository."""
    path = Path(__file__).parents[3].parent / "shared/data/Town05.xodr"
    if not path.exists():
        pytest.skip(f"{path} is not there")
    return path


@pytest.fixture(scope="session")
def town05(town05_path: Path) -> OpenDrive:
    return read(town05_path)
