import os
import re
import subprocess
import sys
from contextlib import suppress
from importlib import resources

import pyoxigraph as ox
import pytest
import rdflib
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.errors import FileFormatError, StorageError
from bridgegen.scenario.ontology import files
from bridgegen.scenario.ontology.files import from_bytes, load, save, to_bytes
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.individuals import build_static
from bridgegen.scenario.ontology.vocabulary import BG, OWL, RDFS, SCENARIOS, TYPE, XSD, bg, tbox

HEAD = (
    '<rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#" '
    'xmlns:owl="http://www.w3.org/2002/07/owl#" xmlns:bg="https://w3id.org/bridgegen#" '
    'xmlns:xsd="http://www.w3.org/2001/XMLSchema#">'
)


def test_what_was_saved_is_loaded(individuals, tmp_path):
    save(individuals, tmp_path / "s.owl")
    assert set(load(tmp_path / "s.owl").quads) == set(individuals.quads)


def test_saving_again_changes_nothing(individuals, tmp_path):
    first = to_bytes(individuals)
    assert to_bytes(from_bytes(first)) == first


SAVES = """
import sys
from bridgegen.scenario.ontology.files import from_bytes, to_bytes
sys.stdout.buffer.write(to_bytes(from_bytes(sys.stdin.buffer.read())))
"""


def test_every_process_writes_the_same_bytes(individuals):
    """Also of anonymous nodes, the ontology's own and a user's, which a parser calls at random."""
    part, rest = ox.BlankNode(), ox.BlankNode()
    scenario = individuals.one("Scenario")
    mine = [ox.Quad(scenario, ox.NamedNode("urn:mine"), part),
            ox.Quad(part, ox.NamedNode("urn:next"), rest),
            ox.Quad(rest, ox.NamedNode("urn:last"), ox.Literal("end"))]  # fmt: skip
    data = to_bytes(Individuals([*individuals.quads, *mine]))
    for seed in ("0", "1"):
        again = subprocess.run(
            [sys.executable, "-c", SAVES], input=data, capture_output=True, timeout=300,
            env=os.environ | {"PYTHONHASHSEED": seed}, check=True,
        )  # fmt: skip
        assert again.stdout == data


def test_anonymous_nodes_stay_apart():
    nodes = [ox.BlankNode(name) for name in ("b2", "b1", "x")]
    quads = [ox.Quad(bg("s"), bg("has"), node) for node in nodes]
    quads += [ox.Quad(node, bg("name"), ox.Literal(node.value)) for node in nodes]
    back = from_bytes(to_bytes(Individuals(quads)))
    names = {q.subject: q.object.value for q in back.quads if q.predicate == bg("name")}
    assert sorted(names.values()) == ["b1", "b2", "x"]
    assert {q.object for q in back.quads if q.predicate == bg("has")} == set(names)


def test_a_road_network_alone_can_be_saved(tmp_path):
    static = build_static(
        {"lane_width": 3, "lanes_per_direction": 1, "arm_length": 50, "intersection_size": 20}
    )
    save(static, str(tmp_path / "s.owl"))
    assert set(load(str(tmp_path / "s.owl")).quads) == set(static.quads)


def test_rdflib_reads_the_same_triples(individuals):
    graph = rdflib.Graph().parse(data=to_bytes(individuals), format="xml")
    theirs = {
        (str(s), str(p), o.toPython() if isinstance(o, rdflib.Literal) else str(o))
        for s, p, o in graph
    }

    def python(term):
        if isinstance(term, ox.Literal):
            kind = term.datatype.value.removeprefix(XSD)
            return {"double": float, "integer": int}.get(kind, str)(term.value)
        return term.value

    assert {(s.value, p.value, python(o)) for s, p, o, _ in individuals.quads} <= theirs
    assert len(graph) == len(tbox().quads) + len(individuals.quads)
    ontologies = list(graph.subjects(rdflib.RDF.type, rdflib.OWL.Ontology))
    assert len(ontologies) == 1  # to a file, or Protégé is confused


def test_every_number_is_a_double_or_an_integer(individuals):
    graph = rdflib.Graph().parse(data=to_bytes(individuals), format="xml")
    kinds = {
        o.datatype for s, p, o in graph
        if isinstance(o, rdflib.Literal) and str(s).startswith(SCENARIOS) and o.datatype
    }  # fmt: skip
    assert kinds <= {rdflib.XSD.double, rdflib.XSD.integer, rdflib.XSD.string}
    assert rdflib.XSD.double in kinds


def test_each_individual_is_written_in_one_piece(individuals):
    text = to_bytes(individuals).decode()
    subjects = re.findall(r'rdf:about="([^"]+#[^"]+)"', text)
    own = [iri for iri in subjects if iri.startswith(SCENARIOS)]
    assert len(own) == len(set(own)) > 30


def test_without_the_ontology_the_file_imports_it(individuals, tmp_path):
    save(individuals, tmp_path / "s.owl", include_tbox=False)
    graph = rdflib.Graph().parse(tmp_path / "s.owl", format="xml")
    assert [str(o) for o in graph.objects(None, rdflib.OWL.imports)] == [
        "https://w3id.org/bridgegen"
    ]
    assert not list(graph.subjects(rdflib.RDF.type, rdflib.OWL.Class))
    assert set(load(tmp_path / "s.owl").quads) == set(individuals.quads)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_numbers_keep_every_bit_in_a_file(value):
    node = ox.NamedNode(SCENARIOS + "t#r")
    one = Individuals(
        [ox.Quad(node, TYPE, bg("Road")), ox.Quad(node, bg("has_length"), ox.Literal(value))]
    )
    assert from_bytes(to_bytes(one, include_tbox=False)).number(node, "has_length") == value


@given(st.text(st.characters(codec="utf-8", exclude_categories=["Cc", "Cs"]), max_size=30))
def test_texts_survive(text):
    text = text.replace("\ufffe", "").replace("\uffff", "")
    node = ox.NamedNode(SCENARIOS + "t#r")
    one = Individuals([ox.Quad(node, bg("has_name"), ox.Literal(text))])
    assert from_bytes(to_bytes(one, include_tbox=False)).text(node, "has_name") == text


def test_saving_is_whole_or_not_at_all(individuals, tmp_path, monkeypatch):
    target = tmp_path / "s.owl"
    target.write_text("before")
    with refuses(StorageError):
        save(individuals, tmp_path / "missing" / "s.owl")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pathlib.Path.replace", full)
    with refuses(StorageError) as caught:
        save(individuals, target)
    assert len(caught.value.problems) == 1
    assert target.read_text() == "before"
    assert os.listdir(tmp_path) == ["s.owl"]


# -- files that somebody edited --------------------------------------------------------------------


def edited(individuals, old, new):
    text = to_bytes(individuals).decode()
    assert old in text
    return from_bytes(text.replace(old, new).encode())


@pytest.mark.parametrize("kind", ["decimal", "integer", "float", "int"])
def test_numbers_get_the_datatype_of_their_property(kind):
    data = (
        f'{HEAD}<bg:Road rdf:about="urn:r"><bg:has_length rdf:datatype="{XSD}{kind}">50'
        f'</bg:has_length><bg:has_inbound_lanes rdf:datatype="{XSD}{kind}">2'
        "</bg:has_inbound_lanes></bg:Road></rdf:RDF>"
    )
    individuals = from_bytes(data.encode())
    node = ox.NamedNode("urn:r")
    assert individuals.values(node, "has_length") == [ox.Literal(50.0)]
    assert individuals.values(node, "has_inbound_lanes") == [ox.Literal(2)]


@pytest.mark.parametrize("text", ["many", "", "1e"])
def test_what_is_no_number_stays_for_the_check_to_find(text):
    data = (
        f'{HEAD}<bg:Road rdf:about="urn:r"><bg:has_length rdf:datatype="{XSD}decimal">{text}'
        "</bg:has_length></bg:Road></rdf:RDF>"
    )
    (value,) = from_bytes(data.encode()).values(ox.NamedNode("urn:r"), "has_length")
    assert value.value == text


def test_half_a_lane_is_not_rounded():
    data = (
        f'{HEAD}<bg:Road rdf:about="urn:r"><bg:has_inbound_lanes rdf:datatype="{XSD}double">1.5'
        "</bg:has_inbound_lanes></bg:Road></rdf:RDF>"
    )
    (value,) = from_bytes(data.encode()).values(ox.NamedNode("urn:r"), "has_inbound_lanes")
    assert value.value == "1.5"


def test_what_a_user_adds_to_the_ontology_stays(individuals):
    taxi = (
        f'<owl:Class rdf:about="{BG}Taxi"><rdfs:subClassOf rdf:resource="{BG}Car"/>'
        '<rdfs:subClassOf><owl:Restriction><owl:onProperty rdf:resource="'
        f'{BG}has_driver"/><owl:hasValue>me</owl:hasValue></owl:Restriction></rdfs:subClassOf>'
        "</owl:Class></rdf:RDF>"
    )
    wider = edited(individuals, "</rdf:RDF>", taxi)
    added = set(wider.quads) - set(individuals.quads)
    assert len(added) == 6
    again = from_bytes(to_bytes(wider))
    assert len(again) == len(wider)
    assert len(again.subclasses("Car")) == 2


def test_disjointness_of_the_users_own_is_not_taken_for_ours(individuals):
    group = (
        '<owl:AllDisjointClasses><owl:members rdf:parseType="Collection">'
        f'<rdf:Description rdf:about="{BG}Fog"/><rdf:Description rdf:about="{BG}Sun"/>'
        f'<rdf:Description rdf:about="{BG}RoadState"/>'  # ends like one of ours
        "</owl:members></owl:AllDisjointClasses></rdf:RDF>"
    )
    wider = edited(individuals, "</rdf:RDF>", group)
    assert len(set(wider.quads) - set(individuals.quads)) == 8
    assert len(from_bytes(to_bytes(wider))) == len(wider)


def test_the_ontology_itself_opened_and_filled_in_protege():
    """Its header then is the ontology's own."""
    source = resources.files("bridgegen.scenario.ontology").joinpath("bridgegen.owl")
    text = source.read_text(encoding="utf-8")
    road = '<bg:Road rdf:about="urn:r"/>'
    individuals = from_bytes(text.replace("</rdf:RDF>", road + "</rdf:RDF>").encode())
    assert individuals.of_class("Road") == [ox.NamedNode("urn:r")]
    about = {quad.subject.value for quad in individuals.quads}
    assert about == {"urn:r", "https://w3id.org/bridgegen"}


# -- files that are no such files ------------------------------------------------------------------


def bomb():
    entities = "".join(f'<!ENTITY e{k} "{f"&e{k - 1};" * 10 if k else "ha"}">' for k in range(12))
    return f"<!DOCTYPE rdf:RDF [{entities}]>{HEAD}<bg:Car>&e11;</bg:Car></rdf:RDF>"


HOSTILE = {
    "entities": bomb(),
    "external entity": f'<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd">]>{HEAD}&x;</rdf:RDF>',
    "external subset": f'<!DOCTYPE rdf:RDF SYSTEM "http://127.0.0.1:9/x.dtd">{HEAD}</rdf:RDF>',
    "deep": f"{HEAD}{'<bg:Car>' * 100_000}",
    "deep and closed": f"{HEAD}{'<bg:Road><bg:has_continuation>' * 50_000}"
    f"{'</bg:has_continuation></bg:Road>' * 50_000}</rdf:RDF>",
    "truncated": HEAD + '<bg:Car rdf:about="urn:c"><bg:has_na',
    "empty": "",
    "text": "Once upon a time",
    "turtle": "@prefix bg: <https://w3id.org/bridgegen#> .\n<urn:c> a bg:Car .\n",
    "opendrive": '<?xml version="1.0"?><OpenDRIVE><header revMajor="1"/></OpenDRIVE>',
    "xml without a namespace": "<a><b/></a>",
    "bad iri": f'{HEAD}<bg:Car rdf:about="http://[broken"/></rdf:RDF>',
    "bad prefix": "<rdf:RDF></rdf:RDF>",
    "unknown encoding": f'<?xml version="1.0" encoding="x-klingon"?>{HEAD}</rdf:RDF>',
    "unsupported encoding": f'<?xml version="1.0" encoding="utf-7"?>{HEAD}</rdf:RDF>',
    "nul": HEAD + "\0</rdf:RDF>",
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_files_are_refused_in_one_line(name, tmp_path):
    path = tmp_path / "h.owl"
    path.write_text(HOSTILE[name], encoding="utf-8")
    with pytest.raises(FileFormatError) as caught:
        load(path)
    (problem,) = caught.value.problems
    assert "\n" not in problem
    assert problem.startswith(f"{path}: ")
    assert len(problem) < 500


def test_a_doctype_in_another_encoding_is_still_a_doctype(tmp_path):
    path = tmp_path / "h.owl"
    path.write_bytes(('<?xml version="1.0" encoding="UTF-16"?>' + bomb()).encode("utf-16"))
    with pytest.raises(FileFormatError, match="DOCTYPE"):
        load(path)


def test_a_type_is_a_class(individuals):
    data = to_bytes(individuals).replace(
        b'<rdf:type rdf:resource="', b'<rdf:type>x</rdf:type><rdf:type rdf:resource="', 1
    )
    with refuses(FileFormatError, "x"):
        from_bytes(data)


def test_binary_noise_is_refused(tmp_path):
    path = tmp_path / "h.owl"
    path.write_bytes(bytes(range(256)) * 10)
    with pytest.raises(FileFormatError):
        load(path)


@given(st.binary(max_size=60), st.integers(0, 5000))
def test_no_damage_gives_a_traceback(individuals, junk, place):
    data = to_bytes(individuals, include_tbox=False)
    damaged = data[:place] + junk + data[place + len(junk) :]
    with suppress(FileFormatError):  # anything else would be a traceback
        assert len(from_bytes(damaged)) >= 0


def test_missing_file_and_folder(tmp_path):
    with refuses(FileFormatError):
        load(tmp_path / "none.owl")
    with refuses(FileFormatError):
        load(tmp_path)


def test_a_pipe_does_not_hang(tmp_path):
    os.mkfifo(tmp_path / "pipe.owl")
    with pytest.raises(FileFormatError, match="not a file"):
        load(tmp_path / "pipe.owl")


def test_an_unreadable_file(tmp_path, monkeypatch):
    path = tmp_path / "s.owl"
    path.write_text("x")

    def refuse(*_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("pathlib.Path.read_bytes", refuse)
    with refuses(FileFormatError):
        load(path)


def test_too_large_a_file_is_not_even_read(tmp_path):
    path = tmp_path / "big.owl"
    with path.open("wb") as file:
        file.truncate(files.MAX_BYTES + 1)  # sparse: takes no room
    with refuses(FileFormatError, "104857601", "104857600"):
        load(path)


def test_imports_are_never_fetched(individuals):
    text = to_bytes(individuals, include_tbox=False).decode()
    imports = '<owl:Ontology rdf:about="urn:o"><owl:imports rdf:resource="file:///etc/passwd"/></owl:Ontology>'
    assert len(from_bytes(text.replace("</rdf:RDF>", imports + "</rdf:RDF>").encode())) == (
        len(individuals) + 2
    )


def test_long_chains_of_anonymous_nodes_are_no_trouble():
    """Written flat, not nested: only the graph is deep."""
    n = 20_000
    links = "".join(
        f'<owl:Thing rdf:nodeID="n{k}"><rdfs:seeAlso rdf:nodeID="n{k + 1}"/></owl:Thing>'
        for k in range(n)
    )
    data = f'{HEAD.replace(">", "")} xmlns:rdfs="{RDFS}">{links}</rdf:RDF>'
    assert len(from_bytes(data.encode())) == 2 * n


def test_circles_of_anonymous_nodes_are_no_trouble():
    data = (
        f'{HEAD.replace(">", "")} xmlns:rdfs="{RDFS}">'
        '<rdf:Description rdf:nodeID="a"><rdfs:seeAlso rdf:nodeID="b"/>'
        '<rdfs:seeAlso rdf:nodeID="a"/>'
        '</rdf:Description><rdf:Description rdf:nodeID="b"><rdfs:seeAlso rdf:nodeID="a"/>'
        "<rdfs:seeAlso rdf:nodeID='b'/></rdf:Description></rdf:RDF>"
    )
    assert len(from_bytes(data.encode())) == 4


def test_the_owl_vocabulary_is_spelled_right():
    """A typo in a namespace would pass every other test of this file."""
    assert str(rdflib.OWL) == OWL
    assert str(rdflib.RDFS) == RDFS
    assert str(rdflib.XSD) == XSD
