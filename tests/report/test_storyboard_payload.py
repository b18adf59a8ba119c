"""A page saves the scenario file of what it shows: byte for byte what the search exports."""

import json
import shutil
import subprocess
from importlib.resources import files

import numpy as np
import pytest
from tests.covering import covering

from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.stated import with_vehicle
from bridgegen.openx.openscenario.values import format_double
from bridgegen.openx.openscenario.write import to_xml
from bridgegen.pages.simulation_payload import simulation_payload
from bridgegen.pages.storyboard_payload import storyboard_payload
from bridgegen.scenario.language.reader import load

HOST = """
import { readFileSync } from "node:fs";
import { inflateSync } from "node:zlib";
import { Simulator } from "./simulator.mjs";
import { fileOf, shellWord } from "./storyboard.mjs";

const { simulation, rows, driver, numbers, words } = JSON.parse(readFileSync("given.json", "utf8"));
const data = (text) => inflateSync(Buffer.from(text, "base64"));
const made = [];
if (simulation) {
  const kernels = new WebAssembly.Module(data(simulation.kernels));
  const { template, holes } = simulation.file;
  const simulator = new Simulator(kernels, simulation, new Uint8Array(data(simulation.data)));
  const evaluate = (...asked) => simulator.evaluate(...asked);
  const text = data(template).toString("utf8");
  for (const values of rows) made.push(fileOf(text, holes, evaluate, values, driver));
}
const written = (x) => fileOf("\ue0000\ue001", [{ of: "x", words: [] }], null, { x }, "");
const digits = numbers.map((x) => written(Number(x)));
console.log(JSON.stringify({ made, digits, words: words.map(shellWord) }));
"""


def in_page(folder, **given):
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed")
    whole = {"simulation": None, "rows": [], "driver": "", "numbers": [], "words": []} | given
    (folder / "given.json").write_text(json.dumps(whole))
    for name in ("simulator", "storyboard"):
        script = files("bridgegen.pages") / "web" / f"{name}.js"
        (folder / f"{name}.mjs").write_text(script.read_text("utf-8"))
    (folder / "host.mjs").write_text(HOST)
    done = subprocess.run(
        [node, "host.mjs"], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def made(scenario, **options):
    logical = load(scenario)
    return Pipeline(logical, logical.space(), PipelineOptions(**options))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("scenario", "options", "other"),
    [
        ("crossroads-s2", {"ego": "route-follower"}, "fsm"),
        ("jam-tail-in-fog", {"vehicle": "single-track"}, None),
        ("motorway-merge", {"ego": "reference", "ideal": ["perception"]}, None),
        ("emergency-vehicle-on-red", {}, "un-r157"),
    ],
)
def test_the_page_s_file_is_the_exporter_s(scenario, options, other, tmp_path):
    pipeline = made(scenario, **options)
    space, found = pipeline.space, simulation_payload(pipeline)
    X = space.decode(np.random.default_rng(11).random((12, space.n_var)))
    rows = [space.values(x) for x in X]
    stem, driver = found["file"]["stem"], other or pipeline.driver.name
    assert found["file"]["drivers"] == ("ideal" not in options)
    texts = in_page(tmp_path, simulation=found, rows=rows, driver=driver)["made"]
    runner = made(scenario, **options | {"ego": driver}).runner
    want = [
        to_xml(with_vehicle(runner.concrete(x, f"{stem}.xodr").storyboard, runner.vehicle))
        for x in X
    ]
    assert [text.encode() for text in texts] == want


def test_numbers_and_words_are_written_as_python_writes_them(tmp_path):
    numbers = [0.0, -0.0, 1.0, -2.5, 1e15, 1e16, 123456789012345680.0, 1e21, 1.5e21, 9.9e21]
    numbers += [1e22, 1e-5, -1.234e-7, 1e-15, 9e-16, 5e-324, 1 / 3, float("inf"), -float("inf")]
    words = ["a=1.5", "it's", "$(x)", "", "a b", "ä"]
    given = [repr(x).replace("inf", "Infinity") for x in numbers]
    found = in_page(tmp_path, numbers=given, words=words)
    assert found["digits"] == [format_double(x) for x in numbers]
    assert found["words"] == ["a=1.5", "'it'\"'\"'s'", "'$(x)'", "''", "'a b'", "'ä'"]


def test_files_that_differ_in_more_are_refused_with_the_reason():
    pipeline = made("cyclist-right-turn")
    X = pipeline.space.decode(np.random.default_rng(0).random((2, pipeline.space.n_var)))
    concrete = pipeline.runner.concrete
    pipeline.runner.concrete = lambda x, name: concrete(x, f"{x.sum()}-{name}")
    found = storyboard_payload(pipeline, X)
    assert list(found) == ["refused"]
    assert "differ" in found["refused"]


@pytest.mark.thorough
def test_scenarios_of_the_catalogue_that_are_simulated_in_pages_are_saved():
    for name in covering():
        found = simulation_payload(made(name))
        assert "refused" in found or "refused" not in found["file"], (name, found["file"])
