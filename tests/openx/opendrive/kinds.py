"""A sample of each kind of road network that is made from a template."""

from dataclasses import replace
from typing import Any

from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.scenario.language.roads import Change, LegSpec, RoadsSpec, Segment, usual
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.individuals import build_static
from bridgegen.scenario.ontology.site import Facility
from bridgegen.scenario.ontology.templates import site_of


def town(template: Any, legs: dict[str, LegSpec], **knobs: float) -> RoadsSpec:
    roads = usual(template, sidewalk_width=2.0, lanes_per_direction=1, **knobs)
    return replace(roads, legs=legs)


KINDS: dict[str, RoadsSpec] = {
    "signals": replace(
        usual("crossroads", sidewalk_width=2.0, shoulder_width=0.5), signals="two-phase",
        legs={n: LegSpec(h, crosswalk=True) for n, h in
              (("A", 270.0), ("B", 180.0), ("C", 90.0), ("D", 0.0))},
    ),
    "turn-lanes": replace(
        usual("crossroads", intersection_size=34.0),
        legs={
            "A": LegSpec(270.0, 3, 2, (("left",), ("straight",), ("straight", "right"))),
            "B": LegSpec(180.0, 1, 1),
            "C": LegSpec(90.0, 2, 2, (("left",), ("straight", "right"))),
            "D": LegSpec(0.0, 1, 2, sign="stop"),
        },
    ),
    "t-junction": replace(
        usual("t-junction", sidewalk_width=2.0),
        legs={"A": LegSpec(270.0, sign="yield"), "B": LegSpec(180.0), "D": LegSpec(0.0)},
    ),
    "skewed-t": town("t-junction", {"A": LegSpec(240.0), "B": LegSpec(180.0), "D": LegSpec(5.0)}),
    "bend": town("crossroads", {"A": LegSpec(270.0), "B": LegSpec(180.0)}),
    "five": town("crossroads", {n: LegSpec(72.0 * k) for k, n in enumerate("ABCDE")}),
    "straight": usual("road", lanes=3, lanes_against=1, shoulder_width=1.5, sidewalk_width=2.0),
    "one-way": usual("road", lanes=2, length=1000.0, speed_limit=33.3),
    "downhill": usual("road", lanes=2, lanes_against=1, grade=-0.06),
    "changing": replace(
        usual("road", lanes=2, lanes_against=1, shoulder_width=2.0),
        change=Change(150.0, "rural", "none"),
    ),
    "curved": replace(
        usual("road", lanes=2, lanes_against=2),
        segments=(
            Segment(60.0, 0.0, 0.0), Segment(30.0, 0.0, 0.02), Segment(40.0, 0.02, 0.02),
            Segment(60.0, 0.02, -0.01), Segment(50.0, -0.01, -0.01),
        ),
        crosswalk_at=50.0,
    ),
    "merge": usual("merge"),
    "merge-3": usual("merge", lanes=3, shoulder_width=2.5, merge_length=150.0),
    "roundabout": usual("roundabout"),
    "roundabout-3": town(
        "roundabout", {"A": LegSpec(270.0), "B": LegSpec(150.0), "C": LegSpec(20.0)}, radius=12.0
    ),
    "roundabout-5": town(
        "roundabout", {n: LegSpec(72.0 * k + 3.0) for k, n in enumerate("ABCDE")}, radius=20.0
    ),
}  # fmt: skip


def individuals(name: str) -> Individuals:
    return build_static({}, KINDS[name])


def model(name: str) -> OpenDrive:
    return opendrive_from_owl(individuals(name))


def _furnished() -> Any:
    """A crossroads with everything of layer 2 that a site can have."""
    site = site_of(replace(KINDS["signals"], knobs={**KINDS["signals"].knobs, **_CLOSED}), {})
    more = (
        Facility("StopSign", "A", 8.0, 10.25, governs=("in",)),
        Facility("YieldSign", "B", 8.0, 10.25, governs=("in",)),
        Facility("SpeedLimitSign", "C", 30.0, -10.25, speed_limit=13.9),
        Facility("SpeedLimitSign", "D", 30.0, -10.25, governs=("out",), speed_limit=8.3333),
        Facility("ConstructionCard", "A", 40.0, 10.25, governs=("in",)),
        Facility("Signage", "D", 45.0, 10.25),
        Facility("StreetLight", "A", 20.0, 10.25),
        Facility("StreetLight", "B", 0.0, -10.25),
    )
    return replace(site, facilities=(*site.facilities, *more))


_CLOSED = {"closing_fog_density": 70.0, "closing_precipitation": 33.3}
FURNISHED = _furnished()
