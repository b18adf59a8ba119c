"""What the documentation shows is what there is."""

import importlib.util
import re
import sys
import threading
from pathlib import Path
from xml.etree import ElementTree

import pytest
from tests.approval import approve, refuses

import bridgegen
from bridgegen.cli import main
from bridgegen.engine.constants import CONSTANTS, NOT_VARIED
from bridgegen.scenario.language import reader
from bridgegen.scenario.language.reader import load, names, pack_tables

DOCS = Path(__file__).parents[1] / "docs"
SOURCES = Path(bridgegen.__file__).parent
MAIN_JOB = "## The main job, file by file"


@pytest.fixture(scope="module")
def make():
    spec = importlib.util.spec_from_file_location("make_catalogue", DOCS / "make_catalogue.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_catalogue_is_up_to_date(make):
    """Otherwise: python docs/make_catalogue.py."""
    assert (DOCS / "catalogue.md").read_text("utf-8") == make.catalogue()


@pytest.mark.thorough
@pytest.mark.parametrize("name", names())
def test_every_scenario_has_its_picture(make, name):
    """The same as drawn now, but for the last digit of a pixel: other machines round otherwise."""
    kept = ElementTree.fromstring((DOCS / "catalogue" / f"{name}.svg").read_text("utf-8"))
    drawn = ElementTree.fromstring(make.picture(name))
    assert [(one.tag, one.text) for one in kept.iter()] == [
        (one.tag, one.text) for one in drawn.iter()
    ]
    approve(kept[0].text, load(name).title)


def test_the_language_is_described(make):
    from bridgegen.scenario.language.schema import ScenarioFile
    from bridgegen.scenario.language.story import CONDITIONS
    from bridgegen.scenario.language.story_schema import EventSection, WaypointSection
    from bridgegen.scenario.participants import TYPES

    text = (DOCS / "scenarios.md").read_text("utf-8")
    for kind in CONDITIONS:
        assert f"| `{kind}` |" in text
    for kind in TYPES:
        assert kind in text
    known = {
        "scenario",
        "title",
        "description",
        "source",
        "driver",
        "duration",
        "time_step",
        "axes",
    }
    keys = {*ScenarioFile.model_fields, *EventSection.model_fields, *WaypointSection.model_fields}
    assert [key for key in keys - known if key not in text] == []


def test_the_examples_run(tmp_path):
    import bridgegen as bg

    run = bg.run_search(
        DOCS / "examples" / "oil-spill.yaml", budget=80, triage="none", out=tmp_path / "run"
    )
    assert run.scenarios
    text = run.scenarios[0].with_suffix(".xosc").read_text("utf-8")
    assert 'frictionScaleFactor="$oil_friction"' in text
    assert 'value="$oil_at"' in text


def test_the_documentation_of_drivers_names_what_there_is():
    from bridgegen.drivers.fmu import _is_known

    text = (DOCS / "drivers.md").read_text("utf-8")
    names = ("v", "target_speed", "offset", "stop_distance", "light", "route_3_x", "track_1_vx")
    assert all(f"`{name}`" in text and _is_known(name) for name in names)


def test_every_metric_and_column_is_described():
    from bridgegen.assess.metrics import METRICS
    from bridgegen.simulation.trace import COLUMNS, MORE

    text = (DOCS / "metrics.md").read_text("utf-8")
    rows = [line.split(" | ")[:3] for line in text.splitlines() if line.startswith("| `")]
    told = {row[0].strip("| `"): tuple(row[1:]) for row in rows if len(row) == 3}
    assert {m.name: (m.unit, m.sense) for m in METRICS.values()}.items() <= told.items()
    assert [name for name in (*COLUMNS, *MORE) if f"`{name}`" not in text] == []


def test_every_algorithm_is_listed_as_it_describes_itself():
    from bridgegen.search.algorithms import ALGORITHMS

    text = (DOCS / "algorithms.md").read_text("utf-8")
    table = text[text.index("| name |") : text.index("`bridgegen benchmark algorithms`")]
    rows = [[cell.strip() for cell in line.strip("| ").split(" | ")] for line in table.splitlines()]
    told = {row[0].strip("`"): (row[1], row[3]) for row in rows if row[0].startswith("`")}
    assert told == {name: (one.description, one.source) for name, one in ALGORITHMS.items()}


def test_the_algorithm_of_the_documentation_is_found_and_searches(tmp_path, monkeypatch):
    """As if a package had declared it; it finds more than chance, and can be resumed."""
    from importlib.metadata import EntryPoint, EntryPoints

    import bridgegen as bg
    from bridgegen.base.errors import InputError
    from bridgegen.results.store import Store

    monkeypatch.syspath_prepend(str(DOCS / "examples"))
    point = EntryPoint("neighbours", "my_algorithm:Neighbours", "bridgegen.algorithms")

    def entry_points(**which: str) -> EntryPoints:
        ours = which.get("group") == "bridgegen.algorithms"
        return EntryPoints([point]) if ours else EntryPoints()

    monkeypatch.setattr("importlib.metadata.entry_points", entry_points)
    chosen = {"seed": 1, "deliver": False, "causes": False, "ego": "route-follower"}
    whole, chance = (
        bg.run_search(
            "paper/crossroads-s1", algorithm=name, budget=160, out=tmp_path / name, **chosen
        )
        for name in ("neighbours", "random")
    )
    assert whole.summary.critical > 2 * chance.summary.critical
    assert len(whole.notes["the most critical objectives"]) == 20
    again = bg.run_search(
        "paper/crossroads-s1", algorithm="neighbours", budget=160, out=tmp_path / "again", **chosen
    )
    rows = []
    for run in (whole, again):
        with Store.open(run.folder) as store:
            rows.append(store.read())
    assert rows[0].U.tobytes() == rows[1].U.tobytes()
    with refuses(InputError, "step"):
        bg.run_search("crossroads-s1", algorithm="neighbours", settings={"step": 7}, out=tmp_path)


PAGES = sorted(path for path in DOCS.rglob("*.md") if "generated" not in path.parts)


def anchors(path: Path) -> set[str]:
    """Return the anchors of a page's headings, as GitHub and MyST make them."""
    found = re.findall(r"^#{1,3} (.+)$", path.read_text("utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in found}


@pytest.mark.parametrize("path", [*PAGES, DOCS.parent / "README.md"], ids=lambda path: path.stem)
def test_links_lead_somewhere(path):
    prose = re.sub(r"```.*?```|`[^`\n]*`", "", path.read_text("utf-8"), flags=re.DOTALL)
    for page, anchor in re.findall(r"\]\(([^)#:]*)(?:#([^)]*))?\)", prose):
        target = path.parent / page if page else path
        assert target.exists() or page.startswith("generated/"), page
        assert not anchor or anchor in anchors(target), f"{page}#{anchor}"


def test_decisions_are_listed_by_theme_and_each_has_a_title_of_its_own():
    index = (DOCS / "decisions.md").read_text("utf-8")
    pages = sorted((DOCS / "decisions").glob("*.md"))
    assert [page.stem for page in pages if index.count(f"decisions/{page.stem}") != 2] == []
    titles = [
        title for page in pages for title in re.findall(r"^## (.+)$", page.read_text("utf-8"), re.M)
    ]
    assert len(titles) > 150
    assert len(set(titles)) == len(titles)


def test_the_architecture_page_has_the_rooms_as_their_docstrings_are():
    """Otherwise: python docs/make_architecture.py."""
    spec = importlib.util.spec_from_file_location(
        "make_architecture", DOCS / "make_architecture.py"
    )
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    text = (DOCS / "architecture.md").read_text("utf-8")
    assert made.page(text) == text
    rooms = {one.name for one in made.SOURCES.iterdir() if (one / "__init__.py").exists()}
    assert rooms == set(re.findall(r"^\| \*\*`(\w+)/`", text, re.M))
    assert len(rooms) <= 15


def test_the_page_of_packs_has_the_clauses_as_the_tables_are():
    """Otherwise: python docs/make_packs.py."""
    spec = importlib.util.spec_from_file_location("make_packs", DOCS / "make_packs.py")
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    text = (DOCS / "packs.md").read_text("utf-8")
    assert made.page(text) == text
    assert all(f"### `{pack}`" in text for pack in pack_tables())


def test_the_main_job_goes_through_the_files_of_the_architecture_page_in_that_order(
    tmp_path, monkeypatch
):
    text = (DOCS / "architecture.md").read_text("utf-8")
    _, _, table = text.partition(MAIN_JOB)
    path = re.findall(r"^\| `([\w/]+\.py)` \| `([\w.]+)` \|", table, re.M)
    assert len({file for file, _ in path}) == len(path) <= 20
    calls: dict[tuple[str, str], None] = {}

    def note(frame, event, _):
        if event == "call":
            code = frame.f_code
            calls.setdefault((code.co_filename, code.co_qualname))

    reader._load_shipped.cache_clear()  # another test may have read it in this process
    words = ["search", "crossroads-s3", "--budget", "20", "--out", str(tmp_path / "run")]
    monkeypatch.setattr(sys, "argv", ["bridgegen", *words])
    threading.setprofile(note)
    sys.setprofile(note)
    try:
        with pytest.raises(SystemExit) as end:
            main()
    finally:
        sys.setprofile(None)
        threading.setprofile(None)
    assert not end.value.code
    order = list(calls)
    at = [order.index((str(SOURCES / file), function)) for file, function in path]
    assert at == sorted(at)


def test_ci_names_every_figure_and_status():
    from bridgegen.cli.app import FAILED
    from bridgegen.cli.verdict.of_run import FIGURES

    text = (DOCS / "ci.md").read_text("utf-8")
    assert [name for name in FIGURES if f"`{name}`" not in text] == []
    assert f"exit status is **{FAILED}**" in text


def test_every_function_of_a_formula_is_named():
    from bridgegen.scenario.language.expression import FUNCTIONS

    text = (DOCS / "extend.md").read_text("utf-8")
    (named,) = re.findall(r"^`([a-z ]+)`, with angles in radians", text, re.MULTILINE)
    assert sorted(named.split()) == sorted(FUNCTIONS)


def test_groups_of_entry_points_are_called_as_in_the_code():
    """Under another name a plug-in is never found, and no error says so."""
    groups = {
        group
        for path in SOURCES.rglob("*.py")
        for group in re.findall(r'PlugIns\("\w+", "([\w.]+)"\)', path.read_text("utf-8"))
    }
    told = {
        group
        for page in PAGES
        for group in re.findall(r'entry-points\."([\w.]+)"', page.read_text("utf-8"))
    }
    assert told == groups


def test_pages_that_are_made_of_the_code_can_be_made(tmp_path):
    spec = importlib.util.spec_from_file_location("make_reference", DOCS / "make_reference.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.write(tmp_path)
    commands = (tmp_path / "command-line.md").read_text("utf-8")
    for words in ("## bridgegen search", "## bridgegen list parameters", "`--fail-if <"):
        assert words in commands
    keys = (tmp_path / "scenario-files.md").read_text("utf-8")
    assert "| **`template`** | `crossroads`, `t-junction`" in keys
    assert "| `to` | text | Other participant" in keys
    assert "cloudiness ≥ precipitation" in (tmp_path / "weather.md").read_text("utf-8")
    constants = (tmp_path / "constants.md").read_text("utf-8")
    for one in CONSTANTS:
        assert f"| `{one.name}` | {one.words} | {one.value:.4g} |" in constants
    assert all(f"- {what}: " in constants for what in NOT_VARIED)


def test_the_sections_of_a_report_are_called_as_the_page_calls_them():
    web = DOCS.parent / "src/bridgegen/pages/web"
    headings = re.findall(r"<h[23][^>]*>([^<]+)</h[23]>", (web / "page.html").read_text("utf-8"))
    for module in web.glob("*.js"):  # a section may make its own element
        headings += re.findall(r'addSection\(\{.*title: "([^"]+)"', module.read_text("utf-8"))
    text = (DOCS / "read-a-report.md").read_text("utf-8")
    told = [name.rstrip(".") for name in re.findall(r"^\*\*([^*]+)\*\*", text, re.MULTILINE)]
    assert len(told) > 8
    assert [name for name in told if name not in headings] == []
