"""Whether a report re-simulates each row of its run with the bits that the run has.

Of each row: its parameter values, number of instants, status, motion, least distance, speed then,
conflict, type, responsible, rule, partner, severity and delta-v, and all other metrics that the
page computes; and whether its traffic is plausible. What ``simulator.js`` gives in
Node and in Chromium is compared with what ``run.sqlite`` stores; motion, with Python's rollout.
"""

import hashlib
import json
import re
import shutil
import subprocess
import tempfile
import zlib
from base64 import b64decode, b64encode
from collections.abc import Sequence
from importlib.resources import files
from math import inf, isfinite
from pathlib import Path
from typing import Any

import bridgegen as bg
from bridgegen.assess.conflict._measure_kernels import MEASURED
from bridgegen.assess.metrics import TABLE_I
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.results.store import Store
from bridgegen.scenario.language.reader import load, names

DRIVERS = ("route-follower", "reference")
BUDGET = 200

HOST = """
async function bits({ simulation, kernels, tables, rows, any, entities }) {
  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const module = await WebAssembly.compile(bytes(kernels));
  const simulator = new Simulator(module, simulation, bytes(tables)), found = [];
  for (const given of rows) {
    const values = simulator.complete(given), { steps, status } = simulator.run(values);
    const [count, length] = simulator.at.record.x.shape, states = [];
    for (const name of "xyhva") {
      const all = simulator.array("record", name);
      for (let e = 0; e < count; e++) states.push(all.slice(e * length, e * length + steps));
    }
    const digest = await crypto.subtle.digest("SHA-256", await new Blob(states).arrayBuffer());
    const motion = Array.from(new Uint8Array(digest), (byte) => byte.toString(16).padStart(2, "0"));
    const row = { values, steps, status, motion: motion.join("") };
    found.push(row);
    if (status !== 0) continue;
    simulator.judge(steps, status);
    const best = simulator.decisive(any), exact = (x) => (Number.isFinite(x) ? x + 0 : String(x));
    row.implausible = simulator.implausible(steps);
    const metrics = simulator.metrics(steps);
    row.metrics = Object.fromEntries(metrics.map(([name, , x]) => [name, exact(x)]));
    if (!best) continue;
    const { e, kind, read } = best;
    const word = (list, column) => simulation.judged[list][read(e, column)];
    row.conflict = kind;
    row.conflict_type = word("types", "type");
    row.responsible = word("responsible", "responsible");
    row.rule = word("rules", "rule");
    row.partner = e ? entities[e] : "";
    row.severity = simulator.array("verdict", "severity")[e];
    row.delta_v = simulator.array("verdict", "changes")[2 * e];
  }
  return JSON.stringify(found);
}
"""
NODE = """
import("node:fs").then(async ({ readFileSync }) => {
  console.log(await bits(JSON.parse(readFileSync("given.json", "utf8"))));
});
"""
CONFLICT = ("conflict", "conflict_type", "responsible", "rule", "partner")
OPTIONS = ("--no-sandbox", "--disable-background-networking", "--disable-component-update")


def main(scenarios: Sequence[str] = ()) -> None:
    """Print how many rows of each run are equal, of all scenarios or of some.

    Raises:
        SystemExit: not all are.
    """
    from playwright.sync_api import sync_playwright

    script = (files("bridgegen.pages") / "web" / "simulator.js").read_text("utf-8")
    script = script.replace("export class", "class") + HOST
    total = {"rows": 0, "node": 0, "chromium": 0}
    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as folder:
        browser = shutil.which("chromium")
        page = playwright.chromium.launch(executable_path=browser, args=OPTIONS).new_page()
        # Only a page of a server may digest.
        page.route("**/*", lambda route: route.fulfill(body="", content_type="text/html"))
        page.goto("https://localhost/")
        page.add_script_tag(content=script)
        (Path(folder) / "host.cjs").write_text(script + NODE)
        for scenario in scenarios or names():
            for driver in DRIVERS:
                given, want = run_of(scenario, driver, Path(folder) / f"{scenario} {driver}")
                (Path(folder) / "given.json").write_text(json.dumps(given))
                node = subprocess.run(
                    ["node", "host.cjs"], cwd=folder, capture_output=True, text=True, check=True
                )
                found = {"node": json.loads(node.stdout)}
                found["chromium"] = json.loads(page.evaluate("(given) => bits(given)", given))
                print(f"{scenario} {driver}:", end="")
                total["rows"] += len(want)
                for host, rows in found.items():
                    pairs = [*enumerate(zip(rows, want, strict=True))]
                    odd = [(i, unequal(row, one)) for i, (row, one) in pairs if row != one]
                    total[host] += len(want) - len(odd)
                    print(f" {len(want) - len(odd)} of {len(want)} in {host}", end="", flush=True)
                    for i, differing in odd[:3]:
                        print(f"\n  row {i}: {differing}", end="")
                print(flush=True)
    print(total)
    if len({*total.values()}) > 1:
        raise SystemExit(1)


def as_json(value: float) -> float | str:
    """Return a number as JSON has it; NaN equals NaN."""
    return value if isfinite(value) else {inf: "Infinity", -inf: "-Infinity"}.get(value, "NaN")


def unequal(row: dict[str, Any], want: dict[str, Any]) -> dict[str, Any]:
    """Return what differs between two rows: pairs of what is found, and what is wanted."""
    return {
        name: (row.get(name), want.get(name))
        for name in sorted({*row, *want})
        if row.get(name) != want.get(name)
    }


def run_of(scenario: str, driver: str, folder: Path) -> tuple[dict[str, Any], list[Any]]:
    """Search a scenario; return what its report simulates, and what should come of each row."""
    beyond = [name for name in MEASURED if name not in TABLE_I]
    options = {"budget": BUDGET, "keep": 1, "triage": "none", "metrics": beyond}
    bg.run_search(scenario, ego=driver, out=folder, **options)
    page = (folder / "report.html").read_text("utf-8")
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)
    assert found is not None
    data = json.loads(found[1])
    simulation = data["simulation"]
    kernels, tables, rows = (
        zlib.decompress(b64decode(text))
        for text in (simulation["kernels"], simulation["data"], simulation["rows"]["data"])
    )
    searched = simulation["rows"]["names"]
    with Store.open(folder) as store:
        stored = store.at(range(len(store)))
        metrics, parameters = store.metrics, store.parameters
    logical = load(scenario)
    pipeline = Pipeline(logical, logical.space(), PipelineOptions(ego=driver))
    rollout = pipeline.runner.run(stored.X)
    want = []
    for i in range(len(stored)):
        steps, digest = int(rollout.n_steps[i]), hashlib.sha256()
        for name in "xyhva":
            for states in getattr(rollout, name)[i]:
                digest.update(states[:steps].tobytes())
        values = dict(zip(parameters, stored.X[i].tolist(), strict=True))
        row: dict[str, Any] = {"values": values, "steps": steps, "status": int(stored.status[i])}
        want.append(row | {"motion": digest.hexdigest()})
        if stored.status[i]:
            continue
        measured = dict(zip(metrics, stored.metrics[i].tolist(), strict=True))
        shown = [name for name, *_ in simulation["judged"]["metrics"]]
        want[-1]["metrics"] = {name: as_json(measured[name]) for name in shown}
        want[-1]["implausible"] = stored.findings.implausible[i]
        words = {name: getattr(stored.findings, name)[i] for name in CONFLICT}
        if words["conflict"] not in ("", "collision course"):
            want[-1] |= words | {name: measured[name] for name in ("severity", "delta_v")}
    count = len(searched)
    exact = memoryview(rows).cast("d").tolist()
    given = {
        "simulation": simulation | {"kernels": "", "data": "", "rows": None},
        "kernels": b64encode(kernels).decode(),
        "tables": b64encode(tables).decode(),
        "rows": [
            dict(zip(searched, exact[at : at + count], strict=True))
            for at in range(0, len(exact), count)
        ],
        "any": data["summary"]["harm"] == "harm_any",
        "entities": list(rollout.names),
    }
    return given, want
