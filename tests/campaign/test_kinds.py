"""A search over a category and an angle: all that is written names the values."""

import importlib.util
import json
import re
from pathlib import Path

import numpy as np
import pytest

import bridgegen as bg
from bridgegen.cli.verdict.of_run import PassFailCriteria
from bridgegen.jobs.search.table import _columns, write_tables
from bridgegen.jobs.search.validate import validate_file
from bridgegen.openx.openscenario.read import read
from bridgegen.pages.scenario_page import show_scenario
from bridgegen.results.store import Store

EXAMPLE = Path(__file__).parents[2] / "docs/examples/braking-manner.yaml"
NAMES = ("gentle", "firm", "emergency")


@pytest.fixture(scope="module")
def searched(tmp_path_factory):
    out = tmp_path_factory.mktemp("runs") / "run"
    return bg.run_search(
        EXAMPLE, algorithm="random", budget=40, keep=4, ego="route-follower", triage="short",
        out=out,
    )  # fmt: skip


@pytest.fixture(scope="module")
def run(searched):
    return searched.folder


def rows(folder):
    with Store.open(folder) as store:
        return store, store.read()


def test_exported_files_name_the_value_and_are_valid(run):
    store, found = rows(run)
    files = sorted((run / "critical").glob("0*.xosc"))
    assert files
    for file in files:
        assert validate_file(file) == []
        assert validate_file(file.with_suffix(".owl")) == []
        facts = json.loads(file.with_suffix(".json").read_text("utf-8"))
        x = dict(zip(store.parameters, found.X[facts["row"]].tolist(), strict=True))
        word = NAMES[int(x["manner"])]
        assert facts["parameters"]["manner"] == {"value": word, "unit": "1"}
        wind = facts["parameters"]["wind_from"]["value"]
        assert wind == pytest.approx(x["wind_from"] % 360.0)
        said = {one.name: one.value for one in read(file).parameter_declarations.parameters}
        assert said["manner"] == word


def test_the_verdict_names_the_values(searched, tmp_path):
    PassFailCriteria.read(["critical > 0"], tmp_path / "junit.xml").judge(searched)
    text = (tmp_path / "junit.xml").read_text("utf-8")
    assert re.search(f"manner = ({'|'.join(NAMES)})\n", text)
    assert re.search(r"wind_from = [0-9.]+ deg\n", text)


def test_the_report_names_the_values(run):
    text = (run / "report.html").read_text("utf-8")
    (data,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', text, re.S)
    sent = json.loads(data)
    columns = {one["name"]: one for one in sent["rows"]["columns"]}
    assert columns["manner"]["words"] == list(NAMES)
    assert columns["wind_from"]["turn"] == 360.0
    assert "words" not in columns["gap"]
    bins = {one["name"]: one for one in sent["coverage"]["parameters"]}
    assert bins["manner"]["words"] == list(NAMES)
    assert len(bins["manner"]["evaluated"]) == 3
    assert bins["wind_from"]["turn"] == 360.0


def test_a_table_names_the_values(run):
    store, found = rows(run)
    assert store.labels == {"manner": {"words": list(NAMES)}, "wind_from": {"turn": 360.0}}
    columns = _columns(store, {}, found, np.ones(len(found)))
    x = dict(zip(store.parameters, found.X.T, strict=True))
    assert columns["manner"] == [NAMES[int(value)] for value in x["manner"]]
    np.testing.assert_allclose(columns["wind_from"] % 360.0, x["wind_from"] % 360.0)
    assert columns["wind_from"].max() <= 360.0


@pytest.mark.parquet
@pytest.mark.skipif(
    importlib.util.find_spec("pyarrow") is None, reason="the extra 'parquet' is missing"
)
def test_the_file_of_a_table_holds_texts(run, tmp_path):
    import pyarrow.parquet as parquet

    (path,) = write_tables([run], tmp_path)
    assert set(parquet.read_table(path)["manner"].to_pylist()) <= set(NAMES)


def test_the_scenario_s_page_names_values_and_angles(tmp_path):
    page = show_scenario(str(EXAMPLE), tmp_path / "page.html").read_text("utf-8")
    assert '>gentle, firm, emergency</td><td data-title="default">firm</td>' in page
    assert '>300 to 60 deg</td><td data-title="default">360 deg</td>' in page


def test_a_file_whose_text_varies_is_searched(run, tmp_path):
    """The exported scenario again, with a distribution over its category."""
    source = sorted((run / "critical").glob("0*.xosc"))[0]
    (tmp_path / "ranges.xosc").write_text(
        f"""<OpenSCENARIO>
  <FileHeader revMajor="1" revMinor="2" date="2025-01-01T00:00:00" description="" author=""/>
  <ParameterValueDistribution>
    <ScenarioFile filepath="{source}"/>
    <Deterministic>
      <DeterministicSingleParameterDistribution parameterName="manner">
        <DistributionSet><Element value="gentle"/><Element value="emergency"/></DistributionSet>
      </DeterministicSingleParameterDistribution>
    </Deterministic>
  </ParameterValueDistribution>
</OpenSCENARIO>
""",
        "utf-8",
    )
    out = tmp_path / "run"
    bg.run_search(
        source, distribution=tmp_path / "ranges.xosc", algorithm="random", budget=12, keep=3,
        ego="route-follower", triage="short", out=out,
    )  # fmt: skip
    store, found = rows(out)
    x = dict(zip(store.parameters, found.X.T, strict=True))
    words = np.array(store.labels["manner"]["words"])[x["manner"].astype(int)]
    assert set(words) == {"gentle", "emergency"}
    wind = 0.2 * np.cos(np.radians(x["wind_from"]))
    np.testing.assert_allclose(x["deceleration"], np.where(words == "gentle", 2.0, 6.0) + wind)
    for file in (out / "critical").glob("0*.xosc"):
        said = {one.name: one.value for one in read(file).parameter_declarations.parameters}
        rate = {"gentle": 2.0, "emergency": 6.0}[said["manner"]]
        assert float(said["deceleration"]) == pytest.approx(rate + wind[0])
        assert validate_file(file) == []
