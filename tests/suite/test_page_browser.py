"""The page of a suite in a real browser: sorting, filters, playbacks, a thousand entries."""

from pathlib import Path

import pytest

from bridgegen.jobs.suite.page import write_suite_page
from bridgegen.jobs.suite.results import EntryResult, RowResult
from bridgegen.jobs.suite.suite import SuiteRun, evaluate_suite

pytestmark = pytest.mark.browser

WIDTHS = (1440, 390)
BAD = '<img src=x onerror="document.title=1">\u202e{{data}}'


@pytest.fixture
def show(browser):
    pages = []

    def open_(path: Path, fragment: str = "", width: int = 1440, **context):
        page = browser.new_page(viewport={"width": width, "height": 900}, **context)
        page.complaints, page.asked = [], []
        page.on("pageerror", lambda error: page.complaints.append(str(error)))
        page.on("console", lambda m: page.complaints.append(m.text) if m.type == "error" else None)
        page.on("request", lambda request: page.asked.append(request.url))
        page.goto(path.as_uri() + fragment)
        pages.append(page)
        return page

    yield open_
    for page in pages:
        assert page.complaints == []
        assert [url for url in page.asked if not url.startswith(("file:", "data:", "blob:"))] == []
        page.close()


@pytest.fixture
def written(folder, tmp_path):
    """The page of two drivers on the files, one of which is broken."""
    (folder / "broken.xosc").write_text("<OpenSCENARIO>", "utf-8")
    run = evaluate_suite(
        folder, egos=["route-follower", "reference"],
        criteria=["C-1: always(ego.v < 12 m/s)"], out=tmp_path / "out",
        workers=1,
    )  # fmt: skip
    return run, write_suite_page(run, run.jobs)


def large(folder: Path) -> SuiteRun:
    """A thousand entries with texts of users."""
    folder.mkdir()
    hit = RowResult(
        x=[BAD, 2.0], critical=True, severity=0.2, conflict="contact", partner=BAD, margins=[-1.0]
    )
    kept = RowResult(x=["b", 3.0], margins=[1.0])
    results = tuple(
        EntryResult(
            entry=f"Entry {k:04d} {BAD}", ego="", digest="", scenario="a.xosc", driver="reference",
            title=BAD, parameters=[BAD, "v"], units=["", "m/s"], notes=[BAD],
            criteria=[{"id": "R-1", "formula": "ttc > 1 s", "text": BAD}],
            rows=[hit, kept] * 60 if k % 4 == 0 else [kept] * 30,
        )
        for k in range(1000)
    )  # fmt: skip
    return SuiteRun(folder, ("",), results, {})


@pytest.mark.parametrize("width", WIDTHS)
def test_a_failure_opens_with_its_playback(written, show, width):
    run, path = written
    page = show(path, width=width, color_scheme="dark" if width == 390 else "light")
    assert "route-follower passes" in page.inner_text("#result")
    assert "1 did not run" in page.inner_text("#result")
    worst = next(one for one in run.results if one.verdict == "failed")
    page.locator("#table .open", has_text=worst.entry).click()
    page.wait_for_selector("#table .playback #player:not([aria-busy])")
    assert page.locator("#change-table tr.unfolded").count() == 0  # there is one player
    assert page.evaluate("bridgegen.state().scenario").startswith(worst.entry)
    rows = page.locator(".variations tbody tr")
    assert rows.count() == len(worst.rows)
    assert "fails" in rows.first.inner_text()
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.evaluate("document.querySelector('.variations').scrollWidth") <= width
    before = page.evaluate("bridgegen.state().position")
    page.evaluate("bridgegen.seek(3)")
    assert page.evaluate("bridgegen.state().position") == 3 != before
    page.locator("td > .tabs button", has_text="reference").click()
    page.wait_for_selector("td > .tabs [aria-pressed=true]:has-text('reference')")
    page.locator("#table .open", has_text=worst.entry).click()
    assert page.locator(".variations").count() == 0
    assert page.evaluate(
        "document.getElementById('parked').contains(document.getElementById('player'))"
    )


def test_a_link_opens_the_playback_at_its_time(written, show):
    _, path = written
    page = show(path)
    page.wait_for_selector("#change-table tr.unfolded #player:not([aria-busy])")
    name = page.locator("#change-table .open").nth(1).inner_text().removeprefix("▸ ")
    page = show(path, f"#{name.replace(' ', '%20')}@1.5")
    page.wait_for_selector("#change-table tr.unfolded #player:not([aria-busy])")
    assert page.evaluate("bridgegen.state().scenario") == name
    assert page.evaluate("bridgegen.state().time") == 1.5


@pytest.mark.parametrize("width", WIDTHS)
def test_two_drivers_play_in_step_from_where_they_diverge(written, show, width):
    """The first change is open: both scenes on one clock, side by side where there is room."""
    _, path = written
    page = show(path, width=width)
    page.wait_for_selector("#change-table tr.unfolded #player:not([aria-busy])")
    first = page.locator("#change-table > tbody > tr").first
    assert first.locator(".open").get_attribute("aria-expanded") == "true"
    state = page.evaluate("bridgegen.state()")
    assert state["index"] == state["twin"]["index"] == state["diverged"] > 0
    assert not state["playing"]
    assert page.inner_text("#flag") == "drivers diverge here"
    assert page.locator("#ticks .diverged").count() == 1
    here, there = (page.locator(f"#{name}").bounding_box() for name in ("twin-scene", "scene"))
    if width == 1440:
        assert (here["y"], here["x"] + here["width"] <= there["x"]) == (there["y"], True)
    else:
        assert (here["x"], here["y"] + here["height"] <= there["y"]) == (there["x"], True)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    before = page.evaluate("(bridgegen.seek(bridgegen.state().diverged - 1), bridgegen.state())")
    ego = [each["entities"][0] for each in (before, before["twin"])]
    assert abs(ego[0]["x"] - ego[1]["x"]) <= 0.1
    page.locator("#scene").focus()
    page.keyboard.press("End")
    end = page.evaluate("bridgegen.state()")
    ego = [each["entities"][0] for each in (end, end["twin"])]
    assert abs(ego[0]["x"] - ego[1]["x"]) + abs(ego[0]["y"] - ego[1]["y"]) > 0.1
    page.keyboard.press("v")
    assert page.evaluate("bridgegen.state().index") == state["diverged"]
    page.keyboard.press("Home")
    page.locator("#to-diverged").click()
    assert page.evaluate("bridgegen.state().index") == state["diverged"]


def test_changes_are_filtered_by_kind(written, show):
    _, path = written
    page = show(path)
    page.wait_for_selector("#change-table tr.unfolded #player:not([aria-busy])")
    for kind, n in page.evaluate("bridgegen.data.suite.changed.kinds"):
        chosen = page.locator(f"#change-kinds button[data-kind='{kind}']")
        if kind == "not comparable":
            assert chosen.count() == 0
            continue
        assert chosen.inner_text() == f"{kind} ({n})"
        assert chosen.is_disabled() == (n == 0)
        if n:
            chosen.focus()
            page.keyboard.press("Enter")
            said = page.locator("#change-table .kind").all_inner_texts()
            assert said == [kind] * min(n, 50)
    page.wait_for_selector("#change-table td.picture .glyph, #table .picture .glyph")


def test_the_broken_file_has_its_reason(written, show):
    _, path = written
    page = show(path)
    page.select_option("#verdict", "n0")
    assert page.evaluate("bridgegen.shown()") == ["broken"]
    page.locator("#table .open").click()
    page.wait_for_selector(".told .lost")
    assert "broken.xosc" in page.inner_text(".told .lost")


def test_criteria_choose_the_entries_that_violate_them(written, show):
    run, path = written
    page = show(path)
    violating = {one.entry for one in run.results if any(row.violated for row in one.rows)}
    page.locator("#matrix button", has_text="C-1").click()
    assert set(page.evaluate("bridgegen.shown()")) == violating
    assert page.locator("#table td.ids .id").count() == len(violating) > 0


@pytest.mark.parametrize("width", WIDTHS)
def test_a_thousand_entries_of_hostile_texts(show, tmp_path, width):
    suite = large(tmp_path / "large")
    path = write_suite_page(suite, ())
    assert path.stat().st_size < 3_000_000
    page = show(path, width=width)
    rows = page.locator("#table > tbody > tr")
    assert rows.count() < 200
    assert page.evaluate("bridgegen.shown().length") == 1000
    assert page.locator("img").count() == 0
    page.evaluate("document.getElementById('more').scrollIntoView()")
    page.wait_for_function("document.querySelectorAll('#table > tbody > tr').length > 150")
    page.fill("#text", "entry 0996")
    assert page.evaluate("bridgegen.shown()") == [f"Entry 0996 {BAD}"]
    page.locator("#table .open").click()
    page.wait_for_selector(".variations")
    assert page.locator(".variations tbody tr").count() == 100
    page.locator(".variations > button").click()
    assert page.locator(".variations tbody tr").count() == 120
    head = page.locator(".variations thead button", has_text="v [m/s]")
    head.click()
    head.click()
    assert page.locator(".variations thead th[aria-sort=descending]").count() == 1
    assert "passes" in page.locator(".variations tbody tr").first.inner_text()
    assert page.locator("img").count() == 0
    assert page.evaluate("document.title") != "1"
    assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_sorting_puts_where_egos_differ_first(show, tmp_path):
    (tmp_path / "two").mkdir()
    verdicts = {"a": (0, 0), "b": (1, 1), "c": (1, 0), "d": (0, 1)}
    results = tuple(
        EntryResult(
            entry=name, ego=ego, digest="", scenario="s.xosc", driver=ego,
            rows=[RowResult(critical=bool(fails), severity=0.1 * fails)],
        )
        for name, of in verdicts.items()
        for ego, fails in zip(("A", "B"), of, strict=True)
    )  # fmt: skip
    page = show(write_suite_page(SuiteRun(tmp_path / "two", ("A", "B"), results, {}), ()))
    assert page.evaluate("bridgegen.shown()") == ["c", "d", "b", "a"]
    assert page.inner_text(".differences") == (
        "In 1 only A fails; in 1 only B fails; both fail 1; both pass 1."
    )
    page.select_option("#verdict", "=only B fails")
    assert page.evaluate("bridgegen.shown()") == ["d"]
    page.click("#clear")
    page.locator("#table thead button", has_text="scenario").click()
    assert page.evaluate("bridgegen.shown()") == ["a", "b", "c", "d"]
    page.locator("#table thead button", has_text="scenario").click()
    assert page.evaluate("bridgegen.shown()") == ["d", "c", "b", "a"]


@pytest.mark.parametrize("width", WIDTHS)
def test_what_is_not_judged_is_neither_passed_nor_failed(show, tmp_path, width):
    (tmp_path / "odd").mkdir()
    rows = {
        "kept": [RowResult()],
        "odd": [RowResult(implausible="jump")] * 2,
        "some": [RowResult()] * 2 + [RowResult(unsafe_start=True)],
        "hit": [RowResult(critical=True)],
    }
    results = tuple(
        EntryResult(entry=name, ego="", digest="", scenario="s.xosc", driver="d", rows=some)
        for name, some in rows.items()
    )
    page = show(write_suite_page(SuiteRun(tmp_path / "odd", ("",), results, {}), ()), width=width)
    assert page.evaluate("bridgegen.shown()") == ["hit", "odd", "kept", "some"]
    assert page.inner_text(".headline").endswith("and fails 1; 1 is not judged.")
    cells = page.locator("#table > tbody > tr > td.verdict > span:first-child")
    assert [one.strip() for one in cells.all_inner_texts()] == [
        "fails", "not judged (2)", "passes", "passes 2, 1 of 3 not judged",
    ]  # fmt: skip
    assert page.locator(".result .share i.unjudged").count() == 1
    page.select_option("#verdict", "u0")
    assert page.evaluate("bridgegen.shown()") == ["odd"]
    page.locator("#table .open").click()
    page.wait_for_selector(".variations")
    assert "Not judged: none of 2 variations could be judged" in page.inner_text(".told")
    first = page.locator(".variations tbody tr").first
    assert "not judged" in first.inner_text()
    assert "jump" in first.inner_text()


def test_on_paper_each_row_keeps_its_name(written, show):
    _, path = written
    page = show(path)
    page.wait_for_selector("#change-table tr.unfolded #player:not([aria-busy])")
    page.emulate_media(media="print")
    assert page.locator("#change-table .open").first.is_visible()
    assert page.locator("#table .open").first.is_visible()
    assert not page.locator("#change-kinds button").first.is_visible()
