"""The served page in a real browser: it grows with its run, and plays any scenario."""

import numpy as np
import pytest
from tests.approval import approve

from bridgegen.cli.terminal.view import _redirect
from bridgegen.jobs.dashboard.home import Home
from bridgegen.jobs.view.run_view import RunView
from bridgegen.jobs.view.server import Server
from bridgegen.results.confirmation.record import Outcome, Record, Scenario, digest_of, write_record
from bridgegen.scenario.language.thresholds import Thresholds

pytestmark = pytest.mark.browser

COUNTS = """[bridgegen.data.rows.n, bridgegen.scatter.series.slice(0, 2)
  .reduce((sum, { items }) => sum + items.length, 0)]"""


@pytest.fixture
def opened(browser, growing):
    """The page of a run with 60 rows, its server, and what it asked for and complained of."""
    growing.grow(60)
    server = Server(RunView(growing.folder))
    server.start()
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.complaints, page.asked = [], []
    page.on("pageerror", lambda error: page.complaints.append(str(error)))
    page.on("console", lambda m: page.complaints.append(m.text) if m.type == "error" else None)
    page.on("request", lambda request: page.asked.append(request.url))
    page.goto(server.url)
    yield page, server
    page.close()
    server.shutdown()
    server.server_close()


def test_the_page_that_the_browser_is_started_with_leads_there(opened, tmp_path):
    page, server = opened
    page.goto(_redirect(tmp_path, f"{server.url}#evaluation-3"))
    page.wait_for_url(f"{server.url}#evaluation-3")
    assert page.evaluate("bridgegen.data.rows.n") == 60
    assert page.complaints == []


def test_a_served_page_simulates(opened):
    page, _ = opened
    page.wait_for_selector("#explore input")
    page.evaluate(
        """() => { const slider = document.querySelector("#explore input");
        slider.value = slider.max; slider.dispatchEvent(new Event("input")); }"""
    )
    page.wait_for_selector(".tried:has-text('route-follower')")
    page.click("#explore .map summary")
    page.wait_for_selector(".map p:has-text('3,600 encounters')")
    assert page.workers
    assert page.complaints == []


def test_it_grows_with_its_run_and_says_so(opened, growing):
    page, server = opened
    critical = growing.rows.critical
    assert critical[:60].sum() != critical[:100].sum()
    page.locator("#scatter").scroll_into_view_if_needed()
    page.wait_for_function("bridgegen.scatter.points")
    page.fill("#list-low", "0")  # a filter stays
    page.locator("#scatter").scroll_into_view_if_needed()  # it is drawn where it is seen
    before = page.evaluate("bridgegen.state().position")
    growing.grow(40)
    page.wait_for_function("bridgegen.data.rows.n === 100")
    page.wait_for_function(f"({COUNTS})[1] === 100")
    assert page.inner_text("#live-text") == "Live: 100 of 120 evaluations"
    n = critical[:100].sum()
    assert page.inner_text("#list-note") == f"{n} of {n} critical scenarios"
    assert page.inner_text("#figures").startswith("Simulated\n100 in ")
    assert page.evaluate("bridgegen.state().position") == before
    page.locator("#trend-plots").scroll_into_view_if_needed()
    last = "(({ x, points }) => x.valueAt(points.at(-1).x))(bridgegen.trends[0])"
    # It was drawn before, when the page was idle; in sight it is drawn anew.
    page.wait_for_function(f"Math.abs({last} - bridgegen.data.batches.last.at(-1)) < 1e-6")

    growing.grow(20)
    growing.end()
    page.wait_for_selector("#live-reload")
    assert page.inner_text("#live-text") == "The search has ended: 120 of 120 evaluations"
    page.click("#live-reload")
    page.wait_for_function("window.bridgegen?.data.kept.length === 2")  # it loads again
    assert page.inner_text("#scene-name") == "0001"
    assert page.complaints == []
    assert all(url.startswith((server.url, "data:", "blob:")) for url in page.asked)


def test_any_row_plays_and_its_address_brings_it_back(opened, growing):
    page, _ = opened
    ranks = page.evaluate("bridgegen.data.rows.rank")
    third = ranks.index(3)
    page.locator("#list-body button.from-served").nth(2).click()
    page.wait_for_function(f"bridgegen.state()?.scenario === 'evaluation {third + 1}'")
    page.evaluate("bridgegen.pause(); bridgegen.seek(20)")
    page.wait_for_function(f"location.hash.startsWith('#evaluation-{third + 1}@')")
    told = RunView(growing.folder).motion(third)["playback"]
    assert page.inner_text("#measures h3") == f"Evaluation {third + 1}"
    assert page.evaluate("bridgegen.state().index") == 20
    assert page.is_visible("#made-of")  # its individuals come with it
    address = page.url
    page.goto("about:blank")
    page.goto(address)
    page.wait_for_function(f"bridgegen.state()?.scenario === '{told['name']}'")
    assert page.evaluate("bridgegen.state().index") == 20
    assert page.complaints == []


def test_any_point_of_the_scatter_plot_plays(opened, growing):
    page, _ = opened
    page.locator("#scatter").scroll_into_view_if_needed()
    page.wait_for_function("bridgegen.scatter.points")
    plain = page.evaluate("bridgegen.data.rows.critical.indexOf(0)")
    evaluation = page.evaluate(f"bridgegen.data.rows.evaluation[{plain}]")
    lines = page.evaluate(f"bridgegen.scatter.linesOf({plain})")
    approve(lines[-1])
    page.evaluate(f"bridgegen.scatter.choose({{ item: {plain} }})")
    page.wait_for_function(f"bridgegen.state()?.scenario === 'evaluation {evaluation + 1}'")
    page.wait_for_function("bridgegen.state().playing")
    assert page.is_hidden("#no-motion")
    assert page.complaints == []


def test_a_server_that_is_gone_is_told(opened):
    page, _ = opened
    page.context.set_offline(True)
    page.wait_for_function("document.getElementById('live').dataset.state === 'lost'")
    assert page.inner_text("#live-text").startswith("No longer served")
    # What it has not got it says, and how to see it.
    page.locator("#list-body button").nth(2).click()
    page.wait_for_selector("#no-motion")
    assert "--evaluation" in page.inner_text("#no-motion-command")


def test_a_run_without_a_row_is_shown_once_there_are_some(browser, growing):
    server = Server(RunView(growing.folder))
    server.start()
    page = browser.new_page()
    page.goto(server.url)
    assert page.inner_text("#figures").startswith("Simulated\n0 in ")
    assert "yet" in page.inner_text("#no-scenarios")
    growing.grow(60)
    page.wait_for_selector("#list-body button")
    assert page.is_visible("#space")
    page.close()
    server.shutdown()
    server.server_close()


def test_what_is_confirmed_meanwhile_is_offered(opened, growing):
    page, _ = opened
    rows = growing.rows
    k = int(np.flatnonzero(rows.critical[:60])[0])
    here = Outcome(critical=True, d_min=0.0, v_d=1.0, n_collision=1.0, F=(0.0,))
    failed = Scenario(
        evaluation=k, name=None, row=digest_of(rows.X[k], rows.metrics[k]), here=here, failure="no"
    )
    write_record(
        growing.folder,
        Record(
            simulator="esmini", label="esmini 3.6", settings={}, reference="embedded", run="",
            scenario="crossroads-s4", ego="", thresholds=Thresholds(), objectives=("F",),
            scenarios=(failed,),
        ),
    )  # fmt: skip
    page.wait_for_selector("#live-reload")
    assert page.inner_text("#live-reload") == "Show what other simulators confirmed"
    page.click("#live-reload")
    page.wait_for_function("window.bridgegen?.data.confirmations.length === 1")
    assert "None of 1 scenarios ran in esmini 3.6." in page.inner_text("#elsewhere")
    assert page.complaints == []


def test_a_project_s_home_shows_how_its_searches_go_on(browser, growing):
    growing.grow(60)
    server = Server(Home(growing.folder.parent))
    server.start()
    page = browser.new_page()
    complaints: list[str] = []
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.goto(server.url)
    critical = growing.rows.critical
    page.locator("#growing").get_by_text(
        f"60 of 120 evaluations, {critical[:60].sum()} critical"
    ).wait_for()
    growing.grow(40)
    page.locator("#growing").get_by_text(
        f"100 of 120 evaluations, {critical[:100].sum()} critical"
    ).wait_for()
    assert "not finished: 100 of 120" in page.inner_text("#runs")
    page.click("#growing a")
    page.wait_for_url("**/run/0/")
    page.wait_for_selector("#live-text:has-text('100 of 120')")
    page.click("a.brand")
    page.wait_for_url(server.url)
    growing.grow(20)
    growing.end()
    page.locator("#growing").wait_for(state="hidden")  # it loads again
    assert "not finished" not in page.inner_text("#runs")
    assert complaints == []
    page.close()
    server.shutdown()
    server.server_close()
