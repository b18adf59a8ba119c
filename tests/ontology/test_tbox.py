"""bridgegen.owl as a document: complete for people, and within what OWL 2 DL and Protégé take."""

from importlib.resources import files

import pyoxigraph as ox
import pytest
import rdflib

from bridgegen.ontology.individuals import build
from bridgegen.ontology.site import ArmRoad, Leg, Site, SiteLane
from bridgegen.ontology.vocabulary import BG, DCTERMS, ONTOLOGY, OWL, RDF, RDFS, XSD, bg, tbox

PATH = files("bridgegen.ontology").joinpath("bridgegen.owl")
PAPER_CLASSES = {
    *("AreaEntities", "PointEntities", "ConstructionCard", "RoadCone", "TrafficLight", "Signage"),
    *("Event", "TrafficAccident", "TrafficJam", "Condition", "Trigger"),
    *("Pedestrian", "Vehicle", "Bicycle", "Misc"),
    *("SpeedAction", "LaneChangeAction", "TeleportAction", "EnvironmentAction"),
    *("EnvironmentChangeEvent", "Fog", "Rain", "Sun"),
}
PAPER_PROPERTIES = {
    *("hasSun", "has_weather", "has_world_x", "has_world_y", "has_world_z"),
    *("has_world_pitch", "has_world_yaw", "has_world_roll"),
}


@pytest.fixture(scope="module")
def graph():
    """The ontology, read by rdflib: a parser other than the one the package uses."""
    return rdflib.Graph().parse(data=PATH.read_bytes(), format="xml")


def terms(graph, kind):
    return {
        node
        for node in graph.subjects(rdflib.URIRef(RDF + "type"), rdflib.URIRef(OWL + kind))
        if str(node).startswith(BG)
    }


def test_it_is_rdf_xml_without_a_doctype(graph):
    text = PATH.read_text(encoding="utf-8")
    assert text.startswith("<?xml")
    assert "<!DOCTYPE" not in text
    assert "<!ENTITY" not in text
    everything = tbox().quads
    header = [triple for triple in graph if str(triple[0]) == ONTOLOGY]
    assert len(graph) == len(everything) + len(header)


def test_the_papers_terms_are_there(graph):
    classes = {str(node).removeprefix(BG) for node in terms(graph, "Class")}
    properties = terms(graph, "ObjectProperty") | terms(graph, "DatatypeProperty")
    assert classes >= PAPER_CLASSES
    assert {str(node).removeprefix(BG) for node in properties} >= PAPER_PROPERTIES


def test_has_sun_means_has_sun(graph):
    equivalent = rdflib.URIRef(OWL + "equivalentProperty")
    assert (rdflib.URIRef(BG + "has_sun"), equivalent, rdflib.URIRef(BG + "hasSun")) in graph


def test_every_term_is_explained(graph):
    kinds = ("Class", "ObjectProperty", "DatatypeProperty", "AnnotationProperty")
    for kind in kinds:
        for term in terms(graph, kind):
            for need in (RDFS + "label", RDFS + "comment", DCTERMS + "source"):
                found = list(graph.objects(term, rdflib.URIRef(need)))
                assert len(found) == 1, f"{term} has {len(found)} {need}"
                assert str(found[0]).strip()


def test_every_property_has_one_domain_and_range_of_its_kind(graph):
    classes = terms(graph, "Class")
    datatypes = {rdflib.URIRef(XSD + name) for name in ("double", "integer", "string")}
    for kind, targets in (("ObjectProperty", classes), ("DatatypeProperty", datatypes)):
        for term in terms(graph, kind):
            domains = list(graph.objects(term, rdflib.URIRef(RDFS + "domain")))
            ranges = list(graph.objects(term, rdflib.URIRef(RDFS + "range")))
            assert len(domains) == len(ranges) == 1, term
            assert domains[0] in classes
            assert ranges[0] in targets


def test_no_name_is_used_for_two_kinds_of_thing(graph):
    """OWL 2 DL forbids it for properties, and people cannot tell them apart."""
    kinds = ("Class", "ObjectProperty", "DatatypeProperty", "AnnotationProperty")
    sets = [terms(graph, kind) for kind in kinds]
    assert sum(map(len, sets)) == len(set.union(*sets))


def test_every_term_that_is_mentioned_is_declared(graph):
    declared = set.union(
        *(terms(graph, k) for k in
          ("Class", "ObjectProperty", "DatatypeProperty", "AnnotationProperty"))
    )  # fmt: skip
    mentioned = {
        term
        for triple in graph
        for term in triple
        if isinstance(term, rdflib.URIRef) and str(term).startswith(BG)
    }
    assert mentioned == declared


def test_every_class_but_the_root_has_a_superclass(graph):
    rootless = {
        term for term in terms(graph, "Class")
        if not list(graph.objects(term, rdflib.URIRef(RDFS + "subClassOf")))
    }  # fmt: skip
    assert rootless == {rdflib.URIRef(BG + "ScenarioElement")}


def test_no_class_is_below_two_disjoint_ones(graph):
    """Such a class could have no individual."""
    members = rdflib.URIRef(OWL + "members")
    subclass = rdflib.URIRef(RDFS + "subClassOf")
    groups = [list(graph.items(head)) for head in graph.objects(None, members)]
    assert len(groups) >= 5
    for term in terms(graph, "Class"):
        above = set(graph.transitive_objects(term, subclass))
        for group in groups:
            assert len(above & set(group)) <= 1, term


def test_storyboard_classes_point_to_openscenario(graph):
    see = rdflib.URIRef(RDFS + "seeAlso")
    openscenario = "http://code.asam.net/simulation/standard/openscenario#"
    for name in ("SpeedAction", "TeleportAction", "Event", "Trigger", "LanePosition", "Controller"):
        found = {str(node) for node in graph.objects(rdflib.URIRef(BG + name), see)}
        assert f"{openscenario}{name}" in found


def test_required_properties_belong_to_their_class():
    ontology = tbox()
    for cls, names in ontology.requires.items():
        for name in names:
            assert bg(cls) in ontology.subclasses[bg(ontology.domains[name])], (cls, name)


def test_individuals_use_terms_as_declared(scenario, values):
    """Every class and property that is written is declared, and used within domain and range."""
    lanes = (SiteLane(-1, "in", 3.0), SiteLane(1, "out", 3.0))
    roads = tuple(ArmRoad(str(number), 30.0, "end", lanes) for number in range(2))
    chain = Site("town", "t.xodr", "7", None, tuple(Leg(name, 0.0, roads) for name in "ABCD"))
    ontology = tbox()
    for individuals in (
        build(scenario, values, driver="reference"),
        build(scenario, values, driver="reference", site=chain),
    ):
        for subject, predicate, value, _ in individuals.quads:
            name = predicate.value.removeprefix(BG)
            if name == predicate.value or name == "constraint":
                continue
            domain = ontology.domains[name]
            assert individuals.is_a(subject, domain), f"{name} of {individuals.describe(subject)}"
            if isinstance(value, ox.Literal):
                assert value.datatype == ontology.ranges[name], name
            else:
                target = ontology.ranges[name].value.removeprefix(BG)
                assert individuals.is_a(value, target), f"{name} to {individuals.describe(value)}"
            if name in ontology.functional:
                assert len(individuals.values(subject, name)) == 1, name
