"""Scenarios to read, write and break; helpers are handed out as fixtures."""

import math
from pathlib import Path

import numpy as np
import pyoxigraph as ox
import pytest
from tests.openx.openscenario.strangers import FILE, changed

from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.write import to_xml as roads_to_xml
from bridgegen.openx.openscenario.from_owl import openscenario_from_owl
from bridgegen.openx.openscenario.from_owl.signals import TIME
from bridgegen.openx.openscenario.write import to_xml
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.individuals import build
from bridgegen.scenario.ontology.site import ArmRoad, Leg, Site, SiteLane
from bridgegen.scenario.ontology.vocabulary import TYPE, bg

_SCENARIOS = ("crossroads-s1", "crossroads-s2", "crossroads-s3", "crossroads-s4")


def _individuals(name="crossroads-s4", u=0.5, site=None, **changed) -> Individuals:
    """One concrete scenario: every searched variable at ``u`` of its box, then ``changed``."""
    scenario = load(name)
    space = scenario.space()
    row = space.decode(np.broadcast_to(np.asarray(u, dtype=float), (1, space.n_var)))[0]
    values = dict(zip(space.names, row.tolist(), strict=True)) | changed
    return build(scenario, values, driver="route-follower", site=site)


def _road(road_id: str, length: float, junction_end: str, lanes: int = 2) -> ArmRoad:
    """A road with right-hand traffic: negative lanes run along its reference line."""
    inward = 1 if junction_end == "start" else -1
    return ArmRoad(
        road_id,
        length,
        junction_end,
        tuple(SiteLane(inward * k, "in", 3.5) for k in range(1, lanes + 1))
        + tuple(SiteLane(-inward * k, "out", 3.5) for k in range(1, lanes + 1)),
    )


def _town(**changed: tuple[ArmRoad, ...]) -> Site:
    """Junction 965 of CARLA's Town05, as its road network has it (lengths to the millimetre)."""
    roads = {
        "A": (_road("18", 21.697, "start"), _road("40", 41.817, "start")),
        "B": (_road("1", 50.748, "start"),),
        "C": (_road("17", 11.614, "end"), _road("47", 54.414, "end")),
        "D": (_road("0", 54.907, "end"),),
    } | changed
    headings = {"A": 271.1, "B": 180.1, "C": 90.4, "D": 0.1}
    legs = tuple(Leg(name, headings[name], roads[name]) for name in sorted(roads))
    return Site("Town05", "Town05.xodr", "965", None, legs)


@pytest.fixture(scope="session")
def s4() -> bytes:
    """A file that we wrote."""
    return to_xml(openscenario_from_owl(_individuals(), "crossroads-s4.xodr"))


@pytest.fixture(scope="session", params=_SCENARIOS)
def scenario_name(request) -> str:
    return request.param


@pytest.fixture(scope="session")
def individuals():
    return _individuals


@pytest.fixture(scope="session")
def road():
    return _road


@pytest.fixture(scope="session")
def town():
    return _town


@pytest.fixture(scope="session")
def edited():
    return _edited


@pytest.fixture(scope="session")
def retyped():
    return _retyped


def _edited(source: Individuals, subject: str, predicate: str, *values) -> Individuals:
    """The individuals with all values of one property replaced, as an editor would.

    A text stands for the individual of that name if there is one, unless ``=`` stands before it.
    """
    base = next(q.subject.value for q in source.quads if q.subject.value.endswith("#scenario"))
    node = ox.NamedNode(base.removesuffix("scenario") + subject)
    names = {q.subject.value for q in source.quads}
    assert node.value in names, subject
    terms = []
    for value in values:
        iri = base.removesuffix("scenario") + str(value)
        value = value.removeprefix("=") if isinstance(value, str) else value
        terms.append(ox.NamedNode(iri) if iri in names else ox.Literal(value))
    kept = [q for q in source.quads if (q.subject, q.predicate) != (node, bg(predicate))]
    return Individuals([*kept, *(ox.Quad(node, bg(predicate), term) for term in terms)])


def _retyped(source: Individuals, subject: str, cls: str) -> Individuals:
    """The individuals with one of another class."""
    quads = []
    for quad in source.quads:
        if quad.subject.value.endswith(f"#{subject}") and quad.predicate == TYPE:
            quad = ox.Quad(quad.subject, TYPE, bg(cls))
        quads.append(quad)
    return Individuals(quads)


@pytest.fixture
def folder(individuals, tmp_path) -> Path:
    (tmp_path / "map.xodr").write_bytes(roads_to_xml(opendrive_from_owl(individuals())))
    (tmp_path / "their.xosc").write_text(FILE)
    return tmp_path


@pytest.fixture
def plain(folder) -> Path:
    """The same without what the ontology has no words for."""
    return changed(
        folder, ('cloudState="free"', 'fractionalCloudCover="twoOktas"'),
        (' intensity="0.8"', ""), ("2025-03-20T10:00:00", TIME.text(math.degrees(0.5))),
    )  # fmt: skip
