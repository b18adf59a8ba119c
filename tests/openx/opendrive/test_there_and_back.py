"""Laws of the way there and back: ontology → OpenDRIVE → ontology, and the other way round.

*Nothing is lost.* What a template says of layers 1 and 2 (roads, lanes, strips, segments, areas,
crosswalks, lines, lights, signs, lamps, controllers, phases), every individual and every value of
it, is in the import of its map again, whatever the individuals are called there. Besides, the
import says what the map says more: connecting roads, lane links, places in road coordinates.

*Nothing is made up.* From the import, OWL2OpenDRIVE makes the same file again, byte by byte.

What OpenDRIVE has no words for is in ``userData`` of the file: a junction's class and measures, a
leg's heading as it was written, weather limits, turns that a lane allows, the phases of lights.
Not of layers 1 and 2, and so not in an OpenDRIVE file: bindings to parameters, which belong to a
scenario (`build_static` makes none).
"""

import dataclasses
import itertools
import re
from collections import defaultdict
from typing import Any

import pyoxigraph as ox
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.read import read
from bridgegen.openx.opendrive.to_owl import individuals_from_opendrive
from bridgegen.openx.opendrive.validate import problems
from bridgegen.openx.opendrive.write import to_xml
from bridgegen.scenario.language.roads import RoadsSpec, usual
from bridgegen.scenario.ontology.check import check
from bridgegen.scenario.ontology.files import from_bytes, to_bytes
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.individuals import build_static
from bridgegen.scenario.ontology.site import Facility
from bridgegen.scenario.ontology.templates import site_of
from bridgegen.scenario.ontology.vocabulary import OWL, OWL_ONTOLOGY, TYPE, VERSION_INFO, bg

from .kinds import FURNISHED, KINDS, individuals

EVERY = (*KINDS, "furnished")


def static(name: str) -> Individuals:
    return build_static(FURNISHED) if name == "furnished" else individuals(name)


def said(these: Individuals) -> tuple[dict[Any, set[Any]], set[tuple[Any, Any, Any]]]:
    """Per individual its classes and values, and all links between two."""
    about: dict[Any, set[Any]] = defaultdict(set)
    links = set()
    headers = {quad.subject for quad in these.quads if quad.object == OWL_ONTOLOGY}
    for subject, predicate, value, _ in these.quads:
        if subject in headers or (predicate == TYPE and value.value.startswith(OWL)):
            continue
        if predicate == TYPE or isinstance(value, ox.Literal):
            about[subject].add((predicate, value))
        else:
            links.add((subject, predicate, value))
    return about, links


def embedding(these: Individuals, those: Individuals) -> dict[Any, Any]:
    """Find the individuals again: each has one that all that is said of it is said of.

    Candidates are narrowed down by the links. Where several are left, as of a lane that a map has
    once per lane section, any will do: the last.
    """
    about, links = said(these)
    there, linked = said(those)
    onwards, backwards = defaultdict(set), defaultdict(set)
    for a, name, b in linked:
        onwards[a, name].add(b)
        backwards[b, name].add(a)
    found = {
        node: {other for other, more in there.items() if words <= more}
        for node, words in about.items()
    }
    lost = {node.value: about[node] for node, others in found.items() if not others}
    assert not lost
    while True:
        narrow(found, links, onwards, backwards)
        several = sorted((n for n, others in found.items() if len(others) > 1), key=str)
        if not several:
            break
        found[several[0]] = {max(found[several[0]], key=str)}
    mapping = {node: others.pop() for node, others in found.items()}
    assert len(set(mapping.values())) == len(mapping)
    assert {(mapping[a], name, mapping[b]) for a, name, b in links} <= linked
    return mapping


def narrow(found: Any, links: Any, onwards: Any, backwards: Any) -> None:
    changed = True
    while changed:
        changed = False
        for a, name, b in links:
            for node, other, way in ((a, b, onwards), (b, a, backwards)):
                kept = {one for one in found[node] if way[one, name] & found[other]}
                assert kept, f"no link {name.value} of {node.value} to {other.value}"
                changed |= kept != found[node]
                found[node] = kept


def without_file(these: Individuals) -> Individuals:
    return Individuals(q for q in these.quads if q.predicate != bg("has_map_file"))


def there_and_back(these: Individuals) -> Individuals:
    """Assert both laws; return the import."""
    data = to_xml(opendrive_from_owl(these))
    model = read(data)
    assert problems(model) == []
    imported = individuals_from_opendrive(model, "map.xodr")
    assert [str(one) for one in check(imported)] == []
    imported = from_bytes(to_bytes(imported))
    embedding(these, imported)
    assert to_xml(opendrive_from_owl(without_file(imported))) == data
    return imported


@pytest.mark.parametrize("name", EVERY)
def test_there_and_back(name: str) -> None:
    there_and_back(static(name))


def test_the_law_sees_every_loss() -> None:
    """Take any one statement out of an import, and the law of nothing lost fails."""
    these = static("furnished")
    imported = individuals_from_opendrive(read(to_xml(opendrive_from_owl(these))), "map.xodr")
    mapping = embedding(these, imported)
    headers = (OWL_ONTOLOGY, VERSION_INFO)
    for quad in these.quads:
        if quad.object in headers or quad.predicate in headers:
            continue
        if quad.predicate == TYPE and quad.object.value.startswith(OWL):
            continue
        same = ox.Quad(mapping[quad.subject], quad.predicate, mapping.get(quad.object, quad.object))
        assert same in set(imported.quads)
        with pytest.raises(AssertionError):
            embedding(these, Individuals(q for q in imported.quads if q != same))


@st.composite
def networks(pick: st.DrawFn) -> RoadsSpec:
    """Any measures of any kind, within what the kind allows."""
    name = pick(st.sampled_from(list(KINDS)))
    spec = KINDS[name]
    knobs = dict(spec.knobs)
    for knob, low, high in (
        ("lane_width", 3.0, 3.6), ("speed_limit", 5.0, 35.0), ("sidewalk_width", 0.5, 2.0),
        ("arm_length", 50.0, 80.0), ("after_length", 290.0, 400.0),
        ("intersection_size", 60.0, 90.0), ("green_time", 5.0, 60.0),
        ("closing_fog_density", 10.0, 99.0), ("grade", -0.1, 0.1),
        ("merge_length", 60.0, 150.0), ("radius", 20.0, 40.0), ("taper_length", 20.0, 80.0),
    ):  # fmt: skip
        if knob in knobs:
            knobs[knob] = pick(st.floats(low, high))
    turn = pick(st.floats(-5.0, 5.0))
    legs = {
        leg: dataclasses.replace(one, heading=one.heading + turn) for leg, one in spec.legs.items()
    }
    return dataclasses.replace(spec, knobs=knobs, legs=legs)


@given(spec=networks())
@settings(max_examples=40)
def test_there_and_back_of_any_measures(spec: RoadsSpec) -> None:
    there_and_back(build_static({}, spec))


@given(data=st.data())
@settings(max_examples=20)
def test_there_and_back_of_any_four_legs(data: st.DataObject, sites: Any) -> None:
    there_and_back(build_static(data.draw(sites)))


def test_a_line_without_room_before_it() -> None:
    """A stop line half a metre wide, at the very end of a leg: its place is kept."""
    site = site_of(usual("crossroads"), {})
    line = Facility("StopLine", "A", site.legs[0].roads[0].length, governs=("in",))
    there_and_back(build_static(dataclasses.replace(site, facilities=(line,))))


def test_what_somebody_moved_counts_where_it_is() -> None:
    """Our ``userData`` is exact, but never overrules what can be measured on the map."""
    model = opendrive_from_owl(static("signals"))
    moved = (
        to_xml(model)
        .replace(b'"bridgegen:has_heading" value="270.0"', b'"bridgegen:has_heading" value="10.0"')
        .replace(b'"bridgegen:has_distance" value="6.0"', b'"bridgegen:has_distance" value="50.0"')
    )
    imported = individuals_from_opendrive(read(moved), "map.xodr")
    legs = imported.links(imported.one("Intersection"), "has_leg")
    assert [imported.number(leg, "has_heading") for leg in legs] == [270.0, 180.0, 90.0, 0.0]
    lines = imported.of_class("StopLine")
    assert [imported.number(one, "has_distance") for one in lines] == pytest.approx([6.0] * 4)


@pytest.mark.parametrize(
    ("ours", "broken"),
    [
        ("has_size", "wide"), ("has_size", "inf"), ("class", "Castle"), ("class", "Roundabout"),
        ("class", "Merge"), ("phase", "1"), ("phase", "one green 2.0"), ("phase", "1 green nan"),
        ("allows_turn", "up"), ("has_offset", "1_0"), ("part_of", "1"),
        ("closes_above_fog_density", ""),
    ],
)  # fmt: skip
def test_nonsense_in_user_data_is_passed_over(ours: str, broken: str) -> None:
    """Files come from strangers: what our codes say there is not believed blindly."""
    element = f'<userData code="bridgegen:{ours}" value="{broken}"/>'.encode()
    clean = re.sub(rb"\s*<userData [^>]*/>", b"", to_xml(opendrive_from_owl(static("signals"))))
    for end in (b"</lane>", b"</road>", b"</junction>", b"</controller>", b"</object>"):
        assert end in clean
        imported = individuals_from_opendrive(read(clean.replace(end, element + end)), "x.xodr")
        assert [str(one) for one in check(imported)] == []


def test_other_peoples_user_data_is_dropped() -> None:
    model = opendrive_from_owl(static("signals"))
    theirs = to_xml(model).replace(
        b"</lane>", b'<userData><vectorLane id="1"/></userData><userData code="x"/></lane>'
    )
    assert read(theirs) == model


def test_user_data_is_the_last_child() -> None:
    """As the schema of OpenDRIVE 1.7 has it (g_additionalData)."""
    from lxml import etree

    for name in EVERY:
        root = etree.fromstring(to_xml(opendrive_from_owl(static(name))))
        for element in root.iter():
            tags = [child.tag for child in element]
            ours = [tag == "userData" for tag in tags]
            assert ours == sorted(ours), f"{element.tag}: {tags}"


def test_maps_that_others_made_are_not_made_again(town05: OpenDrive) -> None:
    from bridgegen.base.errors import UnsupportedError

    imported = individuals_from_opendrive(town05, "Town05.xodr")
    with refuses(UnsupportedError, "21"):
        opendrive_from_owl(without_file(imported))


def test_names_survive() -> None:
    for name in EVERY:
        these = static(name)
        imported = individuals_from_opendrive(opendrive_from_owl(these), "map.xodr")
        mapping = embedding(these, imported)
        for node, same in mapping.items():
            assert these.optional_text(node, "has_name") in (
                None, imported.optional_text(same, "has_name"),
            )  # fmt: skip


def test_all_pairs_of_kinds_differ() -> None:
    """The law is not true of just anything: no kind is found in another one's import."""
    imports = {
        name: individuals_from_opendrive(opendrive_from_owl(static(name)), "map.xodr")
        for name in EVERY
    }
    for one, other in itertools.permutations(EVERY, 2):
        if (one, other) == ("signals", "furnished"):  # it has all of it, and more
            continue
        with pytest.raises(AssertionError):
            embedding(static(one), imports[other])
