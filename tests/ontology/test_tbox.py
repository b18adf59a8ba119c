"""bridgegen.owl as a document: complete for people, and within what OWL 2 DL and Protégé take."""

from importlib.resources import files
from pathlib import Path

import pyoxigraph as ox
import pytest
import rdflib

from bridgegen.scenario.language.reader import names
from bridgegen.scenario.ontology.individuals import build
from bridgegen.scenario.ontology.site import ArmRoad, Leg, Site, SiteLane
from bridgegen.scenario.ontology.vocabulary import (
    BG,
    DCTERMS,
    ONTOLOGY,
    OWL,
    RDF,
    RDFS,
    VOCABULARIES,
    XSD,
    bg,
    tbox,
)

PATH = files("bridgegen.scenario.ontology").joinpath("bridgegen.owl")
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


def test_alignment_points_to_terms_that_were_looked_up(graph):
    """`foreign_terms.txt` is what was found in the other vocabularies, group by group."""
    lines = Path(__file__).with_name("foreign_terms.txt").read_text("utf-8").splitlines()
    looked_up = [line for line in lines if line and not line.startswith("#")]
    pairs = list(graph.subject_objects(rdflib.URIRef(RDFS + "seeAlso")))
    assert sorted({str(other) for _, other in pairs}) == sorted(looked_up)
    assert {term for term, _ in pairs} <= terms(graph, "Class")
    namespaces = [namespace for _, namespace in VOCABULARIES.values()]
    for iri in looked_up:
        assert sum(iri.startswith(one) for one in namespaces) == 1


@pytest.mark.parametrize(
    ("name", "counterparts"),
    [
        ("Road", {"odr:T_road", "auto:l1_core#Road", "openlabel:DrivableAreaType"}),
        ("Crossroads", {"odr:T_junction", "auto:l1_de#Crossing",
                        "openlabel:IntersectionCrossroad"}),
        ("Crosswalk", {"odr:T_road_objects_object", "auto:l1_de#Pedestrian_Crossing",
                       "openlabel:SpecialStructurePedestrianCrossing"}),
        ("RoadWorks", {"auto:l3_de#Construction_Site", "openlabel:TemporaryStructureRoadWorks"}),
        ("Car", {"osc:Vehicle", "auto:l4_de#Passenger_Car", "openlabel:VehicleCar"}),
        ("Fog", {"osc:Fog", "auto:l5_de#Fog", "openlabel:ParticulatesWater"}),
        ("StopSign", {"odr:T_road_signals_signal", "auto:l1_de#Halt_Vorfahrt_gewähren",
                      "openlabel:SignsRegulatory"}),
    ],
)  # fmt: skip
def test_classes_of_every_layer_have_counterparts(name, counterparts):
    """A stop sign is StVO sign 206, "Halt. Vorfahrt gewähren"."""
    found = set(tbox().see_also[name])
    spelled = {(prefix, VOCABULARIES[prefix][1]) for prefix in VOCABULARIES}
    assert found == {
        namespace + one.removeprefix(f"{prefix}:")
        for one in counterparts
        for prefix, namespace in spelled
        if one.startswith(f"{prefix}:")
    }


def test_every_layer_is_aligned_with_every_vocabulary():
    """But storyboards are no matter of OpenDRIVE, nor roads of OpenSCENARIO."""
    ontology = tbox()
    aligned = {
        (ontology.layer(cls), prefix)
        for cls, others in ontology.see_also.items()
        for prefix, (_, namespace) in VOCABULARIES.items()
        if any(other.startswith(namespace) for other in others)
    }
    assert aligned >= {(layer, prefix) for layer in range(1, 6) for prefix in ("auto", "openlabel")}
    assert {prefix for layer, prefix in aligned if layer == 1} == {
        "osc", "odr", "auto", "openlabel",
    }  # fmt: skip
    assert {layer for layer, prefix in aligned if prefix == "osc"} >= {None, 2, 4, 5}


NO_LAYER = {
    # what a scenario is told with, as OpenSCENARIO has it, lies across the layers
    *("ScenarioElement", "Scenario", "Parameter", "DerivedParameter", "LocatedElement", "Static"),
    *("Event", "StoryboardEvent", "Trigger", "Condition", "ConditionGroup", "Action"),
    *("Position", "LanePosition", "WorldPosition", "Route", "Trajectory", "Vertex", "Controller"),
    *("Ghost", "Act", "Variable", "OpenScenarioPosition", "MinedScenario", "Statistic"),
}
TOP_OF_LAYER = {
    1: ("RoadNetwork", "AreaEntities", "GeometrySegment", "JunctionConnection", "LaneLink"),
    2: ("PointEntities", "SignalController", "SignalPhase", "SignalChangeEvent"),
    3: ("TemporaryChange",),
    4: ("TrafficParticipant",),
    5: ("WeatherEnvironment", "EnvironmentChangeEvent", "EnvironmentAction"),
}


def test_every_class_has_a_layer_unless_it_lies_across_them(graph):
    ontology = tbox()
    names = {str(node).removeprefix(BG) for node in terms(graph, "Class")}
    without = {name for name in names if ontology.layer(name) is None}
    kinds = {  # of actions and conditions
        name
        for name in names
        if {"Action", "Condition"} & set(ontology.parents.get(name, ()))
    }  # fmt: skip
    assert without - kinds == NO_LAYER
    for layer, tops in TOP_OF_LAYER.items():
        for top in tops:
            for node in ontology.subclasses[bg(top)]:
                assert ontology.layer(node.value.removeprefix(BG)) == layer, node
    of_a_layer = {
        node.value.removeprefix(BG)
        for tops in TOP_OF_LAYER.values()
        for top in tops
        for node in ontology.subclasses[bg(top)]
    }
    assert names - without == of_a_layer


def test_labels_tell_terms_apart_and_comments_are_sentences(graph):
    for kind in ("Class", "ObjectProperty", "DatatypeProperty"):
        labels = [str(next(graph.objects(t, rdflib.URIRef(RDFS + "label"))))
                  for t in terms(graph, kind)]  # fmt: skip
        for term in terms(graph, kind):
            text = str(next(graph.objects(term, rdflib.URIRef(RDFS + "comment"))))
            assert text.endswith((".", ".)", "…")), text
        assert len(set(labels)) >= len(labels) - 1  # hasSun, has_sun


def test_what_the_vocabulary_reads_is_what_rdflib_reads(graph):
    ontology = tbox()
    for name, kind in ontology.kinds.items():
        (source,) = graph.objects(_any_term(name), rdflib.URIRef(DCTERMS + "source"))
        assert ontology.sources[name] == str(source)
        assert (_any_term(name), rdflib.URIRef(RDF + "type"), rdflib.URIRef(OWL + kind)) in graph
    for name, parents in ontology.parents.items():
        above = graph.objects(rdflib.URIRef(BG + name), rdflib.URIRef(RDFS + "subClassOf"))
        assert sorted(parents) == sorted(str(one).removeprefix(BG) for one in above)
    members = rdflib.URIRef(OWL + "members")
    groups = {
        tuple(str(one).removeprefix(BG) for one in graph.items(head))
        for head in graph.objects(None, members)
    }
    assert set(ontology.disjoint) == groups


def _any_term(name):
    return rdflib.URIRef((DCTERMS if name in ("source", "license") else BG) + name)


def test_required_properties_belong_to_their_class():
    ontology = tbox()
    for cls, needed in ontology.requires.items():
        for name in needed:
            assert bg(cls) in ontology.subclasses[bg(ontology.domains[name])], (cls, name)


def test_individuals_use_terms_as_declared(scenario, values, everything, individuals_of):
    """Every class and property that is written is declared, and used within domain and range."""
    lanes = (SiteLane(-1, "in", 3.0), SiteLane(1, "out", 3.0))
    roads = tuple(ArmRoad(str(number), 30.0, "end", lanes) for number in range(2))
    chain = Site("town", "t.xodr", "7", None, tuple(Leg(name, 0.0, roads) for name in "ABCD"))
    ontology = tbox()
    for individuals in (
        build(scenario, values, driver="reference"),
        build(scenario, values, driver="reference", site=chain),
        everything,
        *map(individuals_of, names()),
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
