"""What a page simulates has the bits that Python gets."""

import hashlib
import json
import re
import shlex
import shutil
import subprocess
from importlib.resources import files

import numpy as np
import pytest
from tests.covering import covering

import bridgegen as bg
from bridgegen.assess.conflict._measure_kernels import MEASURED
from bridgegen.assess.conflict.analysis import COURSE, analyse
from bridgegen.assess.conflict.findings import KINDS
from bridgegen.assess.conflict.harm import decisive
from bridgegen.assess.conflict.plausibility import plausibility
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.pages.simulation_payload import simulation_payload
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.embedded import portable

pytestmark = pytest.mark.thorough

STATES = ("x", "y", "h", "v", "a")

HOST = """
import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { inflateSync } from "node:zlib";
import { Simulator } from "./simulator.mjs";

// Infinity is no number of JSON, so numbers are texts.
const measured = (steps, status) => (status ? null : [simulator.implausible(steps),
  Object.fromEntries(simulator.metrics(steps).map(([name, , value]) => [name, String(value)]))]);
const { simulation, rows, driver, asked } = JSON.parse(readFileSync("given.json", "utf8"));
const data = (text) => new Uint8Array(inflateSync(Buffer.from(text, "base64")));
const kernels = new WebAssembly.Module(data(simulation.kernels));
const simulator = new Simulator(kernels, simulation, data(simulation.data));
if (driver) simulator.choose(driver);
for (const values of rows) {
  const { steps, status } = simulator.run(values), hash = createHash("sha256");
  const [count, length] = simulator.at.record.x.shape;
  for (const name of "xyhva") {
    const states = simulator.array("record", name);
    for (let e = 0; e < count; e++) hash.update(states.subarray(e * length, e * length + steps));
  }
  simulator.judge(steps, status);
  const found = simulator.decisive(false);
  const conflict = found ? `${found.kind} with ${found.e}` : "";
  if (asked) console.log(JSON.stringify(measured(steps, status)));
  else console.log(`${steps} ${status} ${hash.digest("hex").slice(0, 16)} ${conflict}`);
}
"""


def made(scenario, driver):
    logical = load(scenario)
    return Pipeline(logical, logical.space(), PipelineOptions(ego=driver))


def here(pipeline, X):
    """Return number of instants, status, digest and conflict of each row, as ``HOST`` does."""
    rollout = pipeline.runner.run(X)
    conflicts = analyse(rollout)
    other, _ = decisive(conflicts)
    for i in range(len(X)):
        steps, digest = int(rollout.n_steps[i]), hashlib.sha256()
        for name in STATES:
            for states in getattr(rollout, name)[i]:
                digest.update(states[:steps].tobytes())
        kind = int(conflicts.kind[i, other[i]])
        conflict = f"{KINDS[kind]} with {other[i]}" if kind > COURSE else ""
        yield f"{steps} {rollout.status[i]} {digest.hexdigest()[:16]} {conflict}"


def elsewhere(pipeline, X, folder, driver=None, **more):
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed")
    rows = [pipeline.space.values(x) for x in X]
    given = {"simulation": simulation_payload(pipeline), "rows": rows, "driver": driver, **more}
    (folder / "given.json").write_text(json.dumps(given))
    script = files("bridgegen.pages") / "web" / "simulator.js"
    (folder / "simulator.mjs").write_text(script.read_text("utf-8"))
    (folder / "host.mjs").write_text(HOST)
    found = subprocess.run(
        [node, "host.mjs"], cwd=folder, capture_output=True, text=True, check=False
    )
    assert found.returncode == 0, found.stderr
    return found.stdout.splitlines()


def rows_of(pipeline, n, seed):
    space = pipeline.space
    return space.decode(np.random.default_rng(seed).random((n, space.n_var)))


@pytest.mark.parametrize(
    ("scenario", "driver"),
    [
        ("crossroads-s4", "route-follower"),
        ("crossroads-s2", "reference"),  # perceives, with noise
        ("cut-in", "un-r157"),  # others are attentive and change lanes
        ("ghost-in-town", "reference"),  # reports what is not there
        ("emergency-vehicle-on-red", "careful"),  # lights, sirens
        ("stopped-after-curve", "route-follower"),  # starts on spirals, beside the road's line
    ],
)
def test_a_page_gets_the_same_bits(scenario, driver, tmp_path):
    pipeline = made(scenario, driver)
    X = rows_of(pipeline, 24, 7)
    want = list(here(pipeline, X))  # the ways that these rows need are planned now
    assert elsewhere(pipeline, X, tmp_path) == want


METRICS = (*MEASURED[:-3], "severity", "delta_v")
"""What every page may compute; it names the metrics that it does not."""

OF_PERCEPTION = MEASURED[-3:]


@pytest.mark.parametrize(
    ("scenario", "driver", "more"),
    [
        ("crossroads-s4", "route-follower", ()),
        ("crossroads-s2", "reference", OF_PERCEPTION),
        ("cut-in", "un-r157", ()),
        ("emergency-vehicle-on-red", "careful", ()),
        ("pedestrian-behind-parked", "reference", OF_PERCEPTION),
        ("bus-pulls-out", "route-follower", ()),
    ],
)
def test_a_page_measures_with_the_same_bits(scenario, driver, more, tmp_path):
    logical, asked = load(scenario), METRICS[:-2] + tuple(more)
    pipeline = Pipeline(logical, logical.space(), PipelineOptions(ego=driver, metrics=asked))
    judged = simulation_payload(pipeline)["judged"]
    assert judged["unmeasured"] == ["harm", "harm_any", "course_ttc", "course_braking"]
    X = rows_of(pipeline, 24, 11)
    rollout = pipeline.runner.run(X)
    values, labels = pipeline.measure(rollout), plausibility(rollout).labels
    found = [json.loads(line) for line in elsewhere(pipeline, X, tmp_path, asked=True)]
    for one, status, row, label in zip(found, rollout.status, values.tolist(), labels, strict=True):
        if status:
            continue
        want = dict(zip(pipeline.metrics, row, strict=True))
        assert one[0] == label
        assert set(one[1]) == {*METRICS, *more}
        assert {n: float(v) for n, v in one[1].items()} == {n: want[n] for n in one[1]}


def test_a_page_knows_what_is_implausible(tmp_path):
    """A car that cuts in faster than tyres let it; no row of the catalogue's is implausible."""
    pipeline = made("cut-in", "route-follower")
    X = rows_of(pipeline, 24, 3)
    X[:, pipeline.space.names.index("change_time")] = np.linspace(0.3, 3.0, len(X))
    labels = plausibility(pipeline.runner.run(X)).labels
    assert len({*labels}) > 1
    found = [json.loads(line) for line in elsewhere(pipeline, X, tmp_path, asked=True)]
    assert [one[0] for one in found] == labels


def test_of_two_conflicts_the_one_decides_that_decides_in_a_search(tmp_path):
    """The ego nearly hits the walker, and leaves the road, which is worse."""
    pipeline = made("pedestrian-at-night", "route-follower")
    given = {
        **{"precipitation": 49.89844354254828, "ego_speed": 9.766651475189065},
        **{"cloudiness": 89.91451761805646, "wind_intensity": 87.5183848960029},
        **{"fog_density": 9.876723269291952, "sun_altitude_angle": -44.161881795772715},
        **{"walker_speed": 1.9104650368767961, "trigger_time": 2.3507842830309365},
        **{"trigger_distance": 31.58784851194912},
    }
    X = pipeline.space.row(given)[None]
    want = list(here(pipeline, X))
    assert want[0].endswith("violation with 0")
    assert elsewhere(pipeline, X, tmp_path) == want


def test_the_module_names_no_file_of_the_machine_that_made_it():
    assert b"_kernels.py" not in portable.MODULE.read_bytes()


@pytest.mark.parametrize(("own", "other"), [("route-follower", "fsm"), ("reference", "careful")])
def test_another_driver_at_the_wheel_drives_as_in_its_own_run(own, other, tmp_path):
    pipeline = made("crossroads-s2", own)
    X = rows_of(pipeline, 16, 5)
    want = list(here(made("crossroads-s2", other), X))
    assert elsewhere(pipeline, X, tmp_path, other) == want
    assert want != list(here(pipeline, X))


def test_a_driver_that_perceives_is_offered_only_where_roads_say_what_it_predicts_by():
    assert "reference" not in simulation_payload(made("crossroads-s2", "careful"))["drivers"]


def test_the_module_is_of_these_kernels():
    """Else run ``tools/portable.py``, which takes two minutes."""
    assert portable.MODULE.read_bytes().endswith(b"\x09bridgegen" + portable.sources().encode())


def test_the_catalogue_is_simulated_in_pages_but_for_a_reason():
    found = {name: simulation_payload(made(name, "route-follower")) for name in covering()}
    refused = {name: one["refused"] for name, one in found.items() if "refused" in one}
    storyboards = "its scenarios differ in the storyboard, not in numbers alone"
    # A participant of some starts at one place or another.
    names = {"cyclist-crosses", "merge-ego", "merges-at-works", "two-at-crossroads"}
    assert refused.keys() == names
    assert refused["cyclist-crosses"] == refused["merge-ego"] == storyboards
    assert refused["merges-at-works"].startswith("its road network takes ")
    assert refused["two-at-crossroads"] == "the ego's driver drives several vehicles"


def test_a_drivers_page_says_why_it_replays_only(tmp_path):
    path = tmp_path / "driver.py"
    path.write_text(
        "class Still:\n    def reset(self, n, step): pass\n"
        "    def drive(self, seen):\n        return seen.v * 0.0 - 1.0\n"
    )
    found = simulation_payload(made("cut-in", f"{path}:Still"))
    assert list(found) == ["refused"]
    assert "Still" in found["refused"]


def test_a_page_says_of_what_else_the_search_s_verdict_is_made(tmp_path):
    def judged(**options):
        run = bg.run_search("cut-in", budget=4, triage="none", **options)
        text = (run.folder / "report.html").read_text("utf-8")
        found = json.loads(text.split('id="data">')[1].split("</script>")[0])["simulation"]
        return {name: found["judged"][name] for name in ("alone", "gated", "criteria")}

    own = {"criteria": ["gap: min(gap to any) > 1 m"], "algorithm": "random"}
    criteria = judged(**own, critical="criteria", out=tmp_path / "criteria")
    assert criteria == {"alone": False, "gated": True, "criteria": True}
    assert judged(**own, out=tmp_path / "harm") == {"alone": True, "gated": True, "criteria": True}
    other = judged(algorithm="random", worse_than="fsm", out=tmp_path / "other")
    assert other == {"alone": False, "gated": True, "criteria": False}


@pytest.mark.browser
def test_an_implausible_encounter_is_said_to_be_left_out(browser, tmp_path):
    options = {"ego": "route-follower", "algorithm": "random", "triage": "none"}
    run = bg.run_search("cut-in", budget=8, keep=1, out=tmp_path / "run", **options)
    path = run.folder / "report.html"
    # Within the scenario's constraints no change of lanes is so fast.
    free = r'\1\g<2>0.3\3"bounds":[],"x":'
    own = r'(\{"name":"change_time",)("low":)2\.0(,[^\[]*?)"bounds":'
    path.write_text(re.sub(own, free, path.read_text("utf-8")), "utf-8")
    page = browser.new_page()
    page.goto(path.as_uri())
    page.wait_for_selector("#explore input")
    page.evaluate(
        """() => {
        const slider = document.querySelector('#explore input[aria-label="change_time"]');
        slider.value = slider.min; slider.dispatchEvent(new Event("input")); }"""
    )
    page.wait_for_selector(".tried:has-text('implausible: turn beyond the tyres')")
    said = page.inner_text(".tried")
    assert "; the search leaves it out. " in said
    assert "FAILS" not in said
    page.close()


@pytest.mark.browser
def test_a_slider_changes_the_encounter_and_rows_play_without_their_motion(browser, cli, tmp_path):
    run = bg.run_search("crossroads-s4", budget=60, keep=2, triage="none", out=tmp_path / "run")
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    asked = []
    page.on("request", lambda request: asked.append(request.url))
    errors = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto((run.folder / "report.html").as_uri())
    page.wait_for_selector("#explore input")
    page.press('#explore input[aria-label="bv_start"]', "End")  # the slider's, not the player's
    page.wait_for_selector(".tried:has-text('no conflict')")
    page.click("text=As found")
    page.wait_for_selector(".tried:has-text('route-follower FAILS: collision with bv')")
    said = page.inner_text(".tried")
    metrics = json.loads((run.folder / "critical" / "0001.json").read_text())
    conflict = metrics["conflict"]
    assert conflict["type"] in said
    assert conflict["rule"] in said
    assert f"responsible: {conflict['responsible']}" in said
    assert f"v_d {metrics['metrics']['v_d']['value']:.4g}" in page.inner_text("#explore")
    assert "Not computed here: harm" in page.inner_text("#explore")
    page.click("#explore details:not(.map) summary")
    assert f"ttc\n{metrics['metrics']['ttc']['value']:.4g}" in page.inner_text("#explore")
    with page.expect_download() as saved:
        page.click("text=Save .xosc")
    metrics_of = {k: v["value"] for k, v in metrics["metrics"].items()}
    folder = tmp_path / "saved"
    folder.mkdir()
    saved.value.save_as(folder / saved.value.suggested_filename)
    with page.expect_download() as road:
        page.click("text=Save map")
    road.value.save_as(folder / road.value.suggested_filename)
    again = bg.simulate_file(folder / "crossroads-s4.xosc").metrics
    assert {name: again[name] for name in ("d_min", "v_d", "harm")} == {
        name: metrics_of[name] for name in ("d_min", "v_d", "harm")
    }
    page.evaluate("navigator.clipboard.writeText = async (text) => { window.copied = text; }")
    page.click("text=Copy command")
    page.wait_for_function("window.copied")
    code, out, err = cli(*shlex.split(page.evaluate("window.copied"))[1:], "--json")
    assert code == 0, err
    assert json.loads(out)["metrics"]["v_d"] == metrics_of["v_d"]
    page.select_option("#explore select[aria-label=Driver]", "un-r157")
    page.wait_for_selector(".tried:has-text('un-r157')")
    page.click("#explore .map summary")
    page.wait_for_selector(".map p:has-text('3,600 encounters')")
    assert page.workers
    assert not errors
    assert len([url for url in asked if not url.startswith("blob:")]) == 1  # the page alone
    drawn = "document.querySelector('.map canvas').toDataURL()"
    with_workers = page.evaluate(drawn)
    page.add_init_script("delete window.Worker")
    page.reload()
    page.select_option("#explore select[aria-label=Driver]", "un-r157")
    page.wait_for_selector(".tried:has-text('un-r157')")
    page.click("#explore .map summary")
    page.wait_for_selector(".map p:has-text('3,600 encounters')")
    assert not page.workers
    assert page.evaluate(drawn) == with_workers
    page.close()


@pytest.mark.browser
def test_a_strip_below_each_slider_says_what_moving_it_would(browser, tmp_path):
    run = bg.run_search("crossroads-s4", budget=300, keep=2, triage="none", out=tmp_path / "run")
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    page.goto((run.folder / "report.html").as_uri())
    name = '#explore input[aria-label="bv_speed"]'
    page.hover(name)
    page.wait_for_selector(f"label:has({name[9:]}) .strip[style*=gradient]")
    strip = page.get_attribute(f"label:has({name[9:]}) .strip", "style")
    colours = re.findall(r"var\(--([\w-]+)\) [\d.]+% [\d.]+%", strip)
    assert len(colours) == 60
    assert {"hit", "soft"} <= set(colours)
    for k in (0, colours.index("hit"), 59):
        page.evaluate(
            """([at, k]) => { const slider = document.querySelector(at);
                 slider.step = "any";
                 slider.value = Number(slider.min) + (k / 59) * (slider.max - slider.min);
                 slider.dispatchEvent(new Event("input")); }""",
            [name, k],
        )
        fails = {"hit": ".tried:has-text('FAILS: collision')", "soft": ".tried:has-text('no conf')"}
        page.wait_for_selector(fails[colours[k]])
    page.close()


@pytest.mark.browser
def test_what_matters_stands_with_its_slices_and_a_column_narrows_the_page(browser, tmp_path):
    run = bg.run_search("crossroads-s4", budget=300, keep=2, out=tmp_path / "run")
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    page.goto((run.folder / "report.html").as_uri())
    (first, *_) = run.triage.influences
    row = page.locator("#importance-body tr").first
    assert row.locator("th").inner_text().startswith(first.name)
    assert row.locator("b").inner_text() == f"{first.distance:.2f}"
    columns = row.locator(".slice button")
    texts = [column.get_attribute("aria-label") for column in columns.all()]
    counts = [re.search(r": (\d+) of (\d+) evaluations", text).groups() for text in texts]
    assert sum(int(n) for _, n in counts) == 300
    assert sum(int(n) for n, _ in counts) == run.summary.critical
    critical = [int(n) for n, _ in counts]
    columns.nth(critical.index(max(critical))).click()
    page.wait_for_selector(f"#list-note:has-text('{max(critical)} of')")
    page.close()
