from xml.etree import ElementTree

import pyoxigraph as ox
import pytest

from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.structure import LAYERS, Members
from bridgegen.scenario.ontology.vocabulary import BG, LABEL, SCENARIOS, SUBCLASS, TYPE, bg, tbox

RDF_ABOUT = "{http://www.w3.org/1999/02/22-rdf-syntax-ns#}about"
NODE = ox.NamedNode(SCENARIOS + "x#one")
OWN = ox.NamedNode(SCENARIOS + "x#Own")


def members(*said: tuple[ox.NamedNode, ox.NamedNode, ox.NamedNode | ox.Literal]) -> Members:
    return Members(Individuals(ox.Quad(*one) for one in said))


def annotated() -> dict[str, int]:
    """Read bg:layer from the file's XML, without our reader."""
    from importlib.resources import files

    root = ElementTree.fromstring(
        files("bridgegen.scenario.ontology").joinpath("bridgegen.owl").read_bytes()
    )
    return {
        cls.attrib[RDF_ABOUT].lstrip("#"): int(layer.text)
        for cls in root
        for layer in cls.findall(f"{{{BG}}}layer")
    }


def test_an_annotated_class_is_in_its_layer():
    found = annotated()
    assert set(found.values()) == set(LAYERS)
    for name, layer in found.items():
        assert members((NODE, TYPE, bg(name))).layer(NODE) == layer, name


@pytest.mark.parametrize("name", ["Scenario", "Parameter", "Trigger", "LanePosition", "Route"])
def test_what_belongs_to_no_layer_has_none(name):
    assert members((NODE, TYPE, bg(name))).layer(NODE) is None


def test_a_new_class_finds_the_layer_of_the_nearest_class_above():
    found = members(
        (OWN, SUBCLASS, bg("TrafficJam")), (OWN, LABEL, ox.Literal("tailback")), (NODE, TYPE, OWN)
    )
    assert found.layer(NODE) == annotated()["TrafficJam"] == 3
    assert found.is_a(NODE, "Event")
    assert found.class_label(found.class_of(NODE)) == "tailback"


def test_a_class_of_the_file_may_say_its_layer_itself():
    found = members(
        (OWN, SUBCLASS, bg("Car")), (OWN, bg("layer"), ox.Literal(5)), (NODE, TYPE, OWN)
    )
    assert found.layer(NODE) == 5


def test_a_layer_that_there_is_not_is_overheard():
    found = members((OWN, bg("layer"), ox.Literal(6)), (NODE, TYPE, OWN))
    assert found.layer(NODE) is None


def test_of_several_classes_the_lowest_is_named():
    found = members((NODE, TYPE, bg("Vehicle")), (NODE, TYPE, bg("Car")))
    assert found.class_of(NODE) == bg("Car")


def test_a_circle_of_classes_is_no_trouble():
    found = members((OWN, SUBCLASS, OWN), (NODE, TYPE, OWN))
    assert found.layer(NODE) is None


def test_the_labels_are_those_of_the_ontology():
    assert tbox().labels["Car"] == "car"
    assert tbox().labels["has_width"] == "has width"
