import json
import re
import resource
import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest
from tests.approval import refuses

from bridgegen.base.errors import StorageError
from bridgegen.pages import page, templates
from bridgegen.pages.page import write_report
from bridgegen.pages.payload import to_json
from bridgegen.pages.sections import SECTIONS

SCRIPTED = ("show", "suite")
VOID = {"meta", "link", "input", "br", "img", "hr"}


class Page(HTMLParser):
    """Checks that tags balance; collects elements with their attributes and text."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.text: dict[str, str] = {}
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        names = [name for name, _ in attrs]
        assert len(set(names)) == len(names), f"attribute twice in <{tag}>"
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open:
            self.text[self.open[-1]] = self.text.get(self.open[-1], "") + data

    def values(self, attribute: str) -> list[str]:
        return [a[attribute] for _, a in self.elements if a.get(attribute)]


@pytest.fixture(scope="module")
def written(report, tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "report.html"
    write_report(path, report)
    return path.read_text(encoding="utf-8")


def embedded(text: str) -> str:
    found = re.findall(r'<script type="application/json" id="data">(.*?)</script>', text, re.S)
    assert len(found) == 1
    return found[0]


def test_it_is_well_formed(written):
    parsed = Page(written)
    ids = parsed.values("id")
    assert len(set(ids)) == len(ids)
    for attribute in ("for", "aria-labelledby", "aria-describedby"):
        assert {one for told in parsed.values(attribute) for one in told.split()} <= set(ids)
    assert {link[1:] for link in parsed.values("href") if link.startswith("#")} <= set(ids)
    assert ("html", {"lang": "en"}) in parsed.elements
    assert sum(tag == "h1" for tag, _ in parsed.elements) == 1


def test_every_control_has_a_name(written):
    parsed = Page(written)
    for tag, attributes in parsed.elements:
        if tag == "canvas" or attributes.get("role") in {"img", "group"}:
            assert attributes.get("aria-label"), (tag, attributes)


def test_nothing_is_fetched(written):
    parsed = Page(written)
    for attribute in ("src", "srcset", "data", "action", "poster", "background"):
        assert parsed.values(attribute) == []
    assert [h for h in parsed.values("href") if not h.startswith("#")] == ["data:,"]
    policy = next(a["content"] for _, a in parsed.elements if "http-equiv" in a)
    assert policy.startswith("default-src 'none';")
    assert "http" not in policy
    assert "connect-src 'none'" in policy
    assert "'unsafe-eval'" not in policy  # WebAssembly alone may be compiled
    parts = [
        one.read_text("utf-8")
        for end in ("html", "css")
        for one in Path(str(templates.ROOT)).rglob(f"*.{end}")
    ]
    for entries in (page.REPORT, *((f"{name}.js",) for name in SCRIPTED)):
        parts += page._bundled(entries)
    own = "".join(parts)
    own = own.replace("http://www.w3.org/2000/svg", "")  # a namespace's name is no address
    for word in ("http:", "https:", "fetch(", "XMLHttpRequest", "import(", "url(", "@import"):
        assert word not in own


def test_the_data_inside_is_the_data(written, report):
    assert embedded(written) == to_json(report)


def test_every_id_that_a_script_asks_for_exists(written):
    scripts = page._bundled(page.SERVED)[0]
    asked = set(re.findall(r'\$\("([\w-]+)"\)', scripts))
    assert len(asked) > 30
    assert asked <= set(Page(written).values("id"))


@pytest.mark.parametrize("name", SCRIPTED)
def test_every_id_of_a_small_page_exists(name):
    scripts = page._bundled((f"{name}.js",))[0]
    asked = set(re.findall(r'\$\("([\w-]+)"\)', scripts))
    text = page.page_of(f"{name}.js", "", "{}").decode()
    assert asked <= set(re.findall(r'id="([\w-]+)"', text))


def test_every_style_of_ours_is_used():
    ours = [file.name for file in page.WEB.iterdir() if file.name.endswith(".css")]
    assert len(ours) > 8
    bundled = [page._bundled(one)[1] for one in (page.SERVED, ("runs.js",), ("suite.js",))]
    still = {name.rpartition("/")[2] for name in templates.STYLES}
    still |= {one.name.replace(".html", ".css") for one in page.WEB.iterdir()}
    assert [
        name
        for name in ours
        if name not in still and not any(page._text(name) in one for one in bundled)
    ] == []


def test_every_section_has_a_place_and_its_data(written):
    """A section names its element in its module; what it draws, here and there."""
    ids = Page(written).values("id")
    sent = json.loads(embedded(written))
    for section in SECTIONS:
        text = page._text(section.module)
        assert f'key: "{section.key}"' in text
        assert section.key in sent
        (host,) = re.findall(r'addSection\(\{ id: "([\w-]+)"', text)
        assert (host in ids) != ("title: " in text.partition("addSection(")[2])


@pytest.mark.parametrize(
    "title",
    ["</title><script>alert(1)</script>", "a & b <i>", "{{data}}", "Süd 交差点", "lone \udc80"],
)
def test_a_hostile_title_is_text(tmp_path, with_summary, title):
    data = with_summary(title=title, scenario=title)
    write_report(tmp_path / "r.html", data)
    text = (tmp_path / "r.html").read_text(encoding="utf-8")
    shown = title.encode("utf-8", "replace").decode()
    assert Page(text).text["title"].strip() == f"{shown}: {shown} – BridgeGen"
    assert json.loads(embedded(text))["summary"]["title"] == title
    assert sum(tag == "script" for tag, _ in Page(text).elements) == 3


@pytest.mark.parametrize(("n", "kept"), [(0, 0), (1, 1), (2, 0), (41, 3)])
def test_small_runs_make_a_page(tmp_path, build, n, kept):
    data = build(n, kept)
    write_report(tmp_path / "r.html", data)
    sent = json.loads(embedded((tmp_path / "r.html").read_text(encoding="utf-8")))
    assert len(sent["rows"]["evaluation"]) == n
    assert len(sent["kept"]) == kept


def test_the_size_stays_in_bounds(tmp_path, build):
    write_report(tmp_path / "r.html", build(400, 10))
    assert (tmp_path / "r.html").stat().st_size < 1e6


def test_a_page_needs_no_heavy_package():
    code = (
        "import sys; from bridgegen.pages import page;"
        "heavy = {'plotly', 'pandas', 'pymoo', 'numba'} & set(sys.modules); assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_missing_folder_is_one_clear_error(tmp_path, report):
    path = tmp_path / "nowhere" / "report.html"
    with refuses(StorageError):
        write_report(path, report)


def test_a_folder_in_its_place_is_one_clear_error(tmp_path, report):
    (tmp_path / "report.html").mkdir()
    with refuses(StorageError):
        write_report(tmp_path / "report.html", report)
    assert [f.name for f in tmp_path.iterdir()] == ["report.html"]


def test_a_full_disk_keeps_the_old_report_and_leaves_no_part(tmp_path, report, with_summary):
    path = tmp_path / "report.html"
    path.write_text("old")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, hard))  # writing on fails, as when full
    try:
        with refuses(StorageError):
            write_report(path, report)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert path.read_text() == "old"
    assert [f.name for f in tmp_path.iterdir()] == ["report.html"]


def test_a_report_replaces_an_older_one(tmp_path, report):
    path = tmp_path / "report.html"
    path.write_text("old")
    write_report(path, replace(report, kept=()))
    assert path.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
