"""The ontology's documentation: complete, well-formed, self-contained, and safe to write."""

import re
import resource
import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser

import pytest
import rdflib
from tests.approval import approve, refuses
from tests.pages import without_theme

from bridgegen.base.errors import InputError, StorageError
from bridgegen.pages.ontology import to_html, write_docs
from bridgegen.scenario.ontology.vocabulary import BG, OWL, RDF, RDFS, VOCABULARIES, tbox

VOID = {"meta", "link", "br", "wbr"}
BLOCKS = {"h3", "p", "dt", "dd", "th", "td", "summary", "span"}
KINDS = ("Class", "ObjectProperty", "DatatypeProperty", "AnnotationProperty")


class Page(HTMLParser):
    """Checks that tags balance; collects elements, and the text of each term's article."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.articles: dict[str, str] = {}
        self.text = ""
        self._article = ""
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        names = [name for name, _ in attrs]
        assert len(set(names)) == len(names), f"attribute twice in <{tag}>"
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)
        if tag == "article":
            self._article = dict(attrs)["id"]
            self.articles[self._article] = ""

    def handle_endtag(self, tag):
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag
        if self._article and tag in BLOCKS:
            self.articles[self._article] += " "
        if tag == "article":
            self._article = ""

    def handle_data(self, data):
        if "style" not in self.open:
            self.text += data
        if self._article:
            self.articles[self._article] += data

    def values(self, attribute: str) -> list[str]:
        return [a[attribute] for _, a in self.elements if a.get(attribute)]


@pytest.fixture(scope="module")
def text():
    return to_html(tbox()).decode()


@pytest.fixture(scope="module")
def page(text):
    return Page(text)


@pytest.fixture(scope="module")
def graph():
    """The ontology as another parser reads it."""
    from importlib.resources import files

    data = files("bridgegen.scenario.ontology").joinpath("bridgegen.owl").read_bytes()
    return rdflib.Graph().parse(data=data, format="xml")


def said(page, name):
    return " ".join(page.articles[name].split())


# -- complete --------------------------------------------------------------------------------------


def test_every_term_has_an_article_with_its_label_comment_and_source(page, graph):
    found = set()
    for kind in KINDS:
        for term in graph.subjects(rdflib.URIRef(RDF + "type"), rdflib.URIRef(OWL + kind)):
            name = re.split("[#/]", str(term))[-1]
            article = said(page, name)
            assert article.startswith(f"{graph.value(term, rdflib.URIRef(RDFS + 'label'))} {name}")
            for need in (RDFS + "comment", "http://purl.org/dc/terms/source"):
                value = " ".join(str(graph.value(term, rdflib.URIRef(need))).split())
                assert value in article, (name, need)
            found.add(name)
    assert found == set(page.articles)
    assert len(found) > 240


def test_every_triple_of_a_class_is_on_its_article(page, graph):
    """Superclass, subclass, layer, requirement, counterpart; and each property at its domain."""
    for kind, both in (("subClassOf", True), ("domain", True), ("seeAlso", False)):
        for one, other in graph.subject_objects(rdflib.URIRef(RDFS + kind)):
            name, target = str(one).removeprefix(BG), str(other).removeprefix(BG)
            if both:
                assert target in said(page, name)
                assert name in said(page, target)
            else:
                names = [
                    f"{prefix}:{target.removeprefix(namespace)}"
                    for prefix, (_, namespace) in VOCABULARIES.items()
                    if target.startswith(namespace)
                ]
                assert len(names) == 1
                assert names[0] in said(page, name)
    for one, other in graph.subject_objects(rdflib.URIRef(BG + "requires")):
        required, owner = str(other).removeprefix(BG), str(one).removeprefix(BG)
        assert required in said(page, owner).partition("Required")[2]
        assert owner in said(page, required).partition("Required by")[2]
    for one, layer in graph.subject_objects(rdflib.URIRef(BG + "layer")):
        assert f"layer {layer}: " in said(page, str(one).removeprefix(BG))


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        # read off bridgegen.owl by hand
        ("has_wind_intensity", ["Domain Wind", "number [%]", "at most one", "Required by Wind"]),
        ("has_radius", ["Domain Roundabout", "number [m], > 0", "Required by Roundabout"]),
        ("has_signal_state", ["text, one of red, red_yellow, yellow, green, off"]),
        ("gives_green_to", ["Domain SignalPhase", "Values TrafficLight any number"]),
        ("has_lane_count", ["Values whole number at most one"]),
        ("has_sun", ["Same as hasSun"]),
        ("RoadWorks", ["layer 3: temporary changes", "Superclasses TemporaryChange (and so Event",
                       "Disjoint with TrafficAccident, NearMiss, TrafficJam", "has_element",
                       "closes_lane", "auto:l3_de#Construction_Site"]),
        ("Car", ["Superclasses Vehicle (and so TrafficParticipant, LocatedElement,",
                 "has_wheelbase, has_max_speed", "from Vehicle", "Inherited"]),
        ("TrafficLight", ["Pointed to by", "gives_green_to", "has_light", "has_signal"]),
        ("PointEntities", ["Superclasses Static, LocatedElement (and so ScenarioElement)"]),
    ],
)  # fmt: skip
def test_what_a_term_s_article_says(page, name, parts):
    for part in parts:
        assert part in said(page, name), said(page, name)


def test_the_overview_shows_each_class_once_in_its_layer(text):
    overview = text[text.index('<h2 id="layers">') : text.index('<h2 id="tree">')]
    cards = re.split(r'<div class="card', overview)[1:]
    assert len(cards) == 6
    classes = [name for name, kind in tbox().kinds.items() if kind == "Class"]
    for number, card in enumerate(cards, start=1):
        inside = re.findall(r'href="#(\w+)"', card)
        layer = number if number < 6 else None
        assert sorted(inside) == sorted(name for name in classes if tbox().layer(name) == layer)


def test_the_tree_shows_every_class_and_points_back_where_it_was_shown(text):
    tree = text[text.index('<h2 id="tree">') : text.index('<h2 id="classes">')]
    shown = re.findall(r'href="#(\w+)"', tree)
    classes = {name for name, kind in tbox().kinds.items() if kind == "Class"}
    assert set(shown) == classes
    twice = {name for name in classes if shown.count(name) > 1}
    # static, and located; an event, and located
    assert twice == {"PointEntities", "TrafficAccident"}
    assert tree.count("↑") == 1  # an accident has no subclasses


def test_the_index_holds_every_term_under_its_letter(text):
    index = text[text.index('<h2 id="index">') :]
    parts = re.split(r'id="index-(.)"', index)[1:]
    found = {}
    for letter, items in zip(parts[::2], parts[1::2], strict=True):
        for name in re.findall(r'href="#(\w+)"', items):
            found[name] = letter
    assert set(found) == set(tbox().kinds)
    assert (found["has_length"], found["hasSun"], found["Lane"]) == ("L", "S", "L")
    assert f'href="#index-{found["Lane"]}"' in text


# -- a page ----------------------------------------------------------------------------------------


def test_it_is_well_formed_and_every_link_leads_somewhere(page):
    ids = page.values("id")
    assert len(set(ids)) == len(ids)
    links = page.values("href")
    assert {link[1:] for link in links if link.startswith("#")} <= set(ids)
    assert set(page.values("aria-labelledby")) <= set(ids)
    assert ("html", {"lang": "en"}) in page.elements
    assert sum(tag == "h1" for tag, _ in page.elements) == 1
    assert "{{" not in page.text


def test_nothing_is_fetched_and_nothing_runs(page, text):
    for attribute in ("src", "srcset", "data", "action", "poster", "background", "style"):
        assert page.values(attribute) == []
    assert [h for h in page.values("href") if not h.startswith("#")] == ["data:,"]
    assert "<script" not in without_theme(text)
    assert not any(name.startswith("on") for _, a in page.elements for name in a)
    policy = next(a["content"] for _, a in page.elements if "http-equiv" in a)
    assert policy.startswith("default-src 'none'; script-src 'sha256-")
    style = text[text.index("<style>") : text.index("</style>")]
    for word in ("http:", "https:", "url(", "@import"):
        assert word not in style
    assert "prefers-color-scheme: dark" in style


HOSTILE = "</p></style><script>alert(1)</script> & \"quoted\" 'x' {{css}} <b"


def test_hostile_words_are_text():
    known = tbox()
    bad = replace(
        known,
        version=HOSTILE,
        labels={**known.labels, "Car": HOSTILE, "has_length": HOSTILE},
        comments={**known.comments, "Car": HOSTILE, "has_length": HOSTILE, "bridgegen": HOSTILE},
        sources={**known.sources, "Car": HOSTILE, "has_length": HOSTILE},
        units={**known.units, "has_length": HOSTILE},
        allowed={**known.allowed, "has_signal_state": (HOSTILE,)},
        constraints={"has_length": (HOSTILE,)},
        see_also={**known.see_also, "Car": (VOCABULARIES["osc"][1] + HOSTILE, HOSTILE)},
    )
    page = Page(without_theme(to_html(bad).decode()))
    assert {tag for tag, _ in page.elements}.isdisjoint({"script", "b"})
    assert said(page, "Car").count(HOSTILE) == 5  # label, comment, source, two counterparts
    assert HOSTILE in said(page, "has_signal_state")
    assert said(page, "has_length").count(HOSTILE) == 5


# -- a file ----------------------------------------------------------------------------------------


def test_the_file_is_the_page_and_an_earlier_one_is_replaced(tmp_path, text):
    path = tmp_path / "o.html"
    write_docs(path)
    assert path.read_text("utf-8") == text
    path.write_text(text.replace("<h1>", "<h1>an older "), "utf-8")
    write_docs(path)
    assert path.read_text("utf-8") == text
    assert [one.name for one in tmp_path.iterdir()] == ["o.html"]
    assert path.stat().st_size < 1e6


def test_another_file_is_not_overwritten(tmp_path):
    path = tmp_path / "notes.html"
    path.write_text("my notes")
    with refuses(StorageError):
        write_docs(path)
    assert path.read_text() == "my notes"


def test_what_cannot_be_written_is_one_clear_error(tmp_path):
    with refuses(InputError):
        write_docs(tmp_path / "o.pdf")
    with refuses(StorageError):
        write_docs(tmp_path / "nowhere" / "o.html")
    (tmp_path / "o.html").mkdir()
    with refuses(StorageError):
        write_docs(tmp_path / "o.html")
    assert [one.name for one in tmp_path.iterdir()] == ["o.html"]


def test_a_full_disk_keeps_the_old_page_and_leaves_no_part(tmp_path):
    path = tmp_path / "o.html"
    write_docs(path)
    before = path.read_bytes()
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, hard))  # writing on fails, as when full
    try:
        with refuses(StorageError):
            write_docs(path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert path.read_bytes() == before
    assert [one.name for one in tmp_path.iterdir()] == ["o.html"]


def test_on_the_command_line(tmp_path):
    command = [sys.executable, "-c", "from bridgegen.cli import main; main()", "ontology", "docs"]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path)
    assert done.stdout == "bridgegen-ontology.html\n"
    assert (tmp_path / "bridgegen-ontology.html").is_file()
    out = ["--out", "nowhere/o.html"]
    done = subprocess.run([*command, *out], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 2
    approve(done.stderr)
