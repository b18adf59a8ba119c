"""Every JSON record of a run, with one value damaged: it is read, or is one clear error."""

import json
import resource
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tests.approval import refuses

import bridgegen as bg
from bridgegen.assess.objective import Objective
from bridgegen.base.errors import BridgeGenError
from bridgegen.engine.constants import Constant
from bridgegen.engine.options import CommonOptions
from bridgegen.jobs.compare.plan import begin, make_plan
from bridgegen.jobs.search.exported import exported_scenarios, not_exported, read_facts
from bridgegen.results.confirmation.record import Outcome, Record, Scenario
from bridgegen.results.confirmation.record import read_record as read_confirmation
from bridgegen.results.store import Store
from bridgegen.scenario.language.thresholds import Thresholds
from bridgegen.search.regions.record import read_record as read_regions
from bridgegen.search.sensitivity import Effect, Finding, Sensitivity
from bridgegen.search.sensitivity import read_record as read_sensitivity
from bridgegen.search.triage.record import read_record as read_triage

MARK = "the value that is damaged"

VALUES = {
    "1e999": "1e999",
    "-1e999": "-1e999",
    "NaN": "NaN",
    "Infinity": "Infinity",
    "-1": "-1",
    "1e300": "1e300",
    "2**63": str(2**63),
    "many digits": "9" * 400,
    "too many digits": "9" * 10_000,
    "empty text": '""',
    "null": "null",
    "list": "[]",
    "list of lists": "[[]]",
    "object": "{}",
    "true": "true",
    "NUL": r'"\u0000"',
    "lone surrogate": r'"\ud800"',
    "long text": '"' + "x" * 10**6 + '"',
    "deep": "[" * 10**5 + "]" * 10**5,
}

NEVER = {"1e999", "-1e999", "NaN", "Infinity", "many digits", "too many digits", "deep"}
NEVER |= {"lone surrogate"}
"""What no record holds at any place."""

EVIDENCE = {"rows": 100, "critical": 90, "failed": 0, "share": 0.9, "interval": [0.8, 0.95]}
REGIONS = {
    "run": "runs/s4", "scenario": "crossroads-s4", "ego": "route-follower", "cause": None,
    "algorithm": "pso", "evaluations": 60, "finished": True, "samples": 100, "at_least": 0.5,
    "seed": 1, "confidence": 0.95, "rows": 60, "critical": 3, "critical_held": 2,
    "space_share": 0.25, "simulations": 100,
    "parameters": [
        {"name": "ego_speed", "unit": "m/s", "integer": False, "low": 1.0, "high": 9.0}
    ],
    "regions": [
        {
            "number": 1, "confirmed": True, "narrowed": False, "rule": "ego_speed >= 5",
            "sentence": "Most are critical.", "named": ["ego_speed"],
            "box": {"ego_speed": {"low": 5.0, "high": 9.0}},
            "fresh": EVIDENCE, "search": EVIDENCE, "space_share": 0.25,
        }
    ],
}  # fmt: skip
HERE = Outcome(critical=True, d_min=0.5, v_d=3.0, n_collision=0.0, F=(1.5, None))
CONFIRMATION = Record(
    simulator="esmini", label="esmini 3.6", settings={"steps": 2}, reference="embedded",
    run="runs/s4", scenario="crossroads-s4", ego="route-follower", thresholds=Thresholds(),
    objectives=("d_min", "v_d"),
    scenarios=(Scenario(evaluation=2, name="0001", row="0" * 16, here=HERE, failure="no road"),),
)  # fmt: skip
SENSITIVITY = Sensitivity(
    scenario="cut-in", ego="reference", results="0" * 64, seed=1, trajectories=4, radius=0.025,
    evaluations=500, left_out=1, not_varied={"wheelbase": "paths lead the rear axle"},
    constants=(
        Constant("a", "the a", 1.0, "s", 0.5, 2.0, "b", "c"),
    ),
    findings=(
        Finding(
            evaluation=3, title="collides", conflict="contact", harm=0.5, sentences=("stands",),
            effects=(
                Effect(
                    name="a", kind="constant", mu_star=0.1, sigma=0.2, flips=1, of=4, at_most=1.5
                ),
            ),
        ),
    ),
)  # fmt: skip
REFUSED = [{"name": "0002", "evaluation": 3, "problems": ["no such lane"]}]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run with critical scenarios, and the records of all that may be done with it."""
    folder = tmp_path_factory.mktemp("damaged") / "run"
    bg.run_search(
        "crossroads-s4",
        ego="route-follower",
        budget=60,
        seed=1,
        keep=1,
        triage="short",
        out=folder,
        causes=False,
    )
    (folder / "regions.json").write_text(json.dumps(REGIONS), "utf-8")
    (folder / "sensitivity.json").write_text(SENSITIVITY.model_dump_json(), "utf-8")
    (folder / "not-exported.json").write_text(json.dumps(REFUSED), "utf-8")
    (folder / "confirmation-esmini.json").write_text(CONFIRMATION.model_dump_json(), "utf-8")
    with Store.open(folder) as store:
        store.settings["chosen"]["objective"] = {"d_min": None}
        (folder / "settings.json").write_text(json.dumps(store.settings), "utf-8")
    compared = folder.parent / "compared"
    begin(plan(compared))
    (compared / "runs" / "a").mkdir()
    (compared / "runs" / "a" / "run.sqlite").touch()
    shutil.copy(compared / "compare.json", folder)
    return folder


def plan(out):
    return make_plan(
        ["crossroads-s4"], ["random"], settings={}, seeds=1, budget=10, baseline=None, apart=0.1,
        out=out, options=CommonOptions(ego="route-follower", fixed={"bv_speed": 3.0}),
    )  # fmt: skip


def read_stored_settings(path):
    """Settings as they lie in the store, by a resumed run and by people."""
    folder = path.parent
    shutil.copy(folder / "run.sqlite", folder / "kept.sqlite")
    try:
        with closing(sqlite3.connect(folder / "run.sqlite")) as db, db:
            text = path.read_text("utf-8")
            db.execute("UPDATE run SET value = ? WHERE key = 'settings'", (text,))
        found = bg.Run(folder)
        Objective.from_dict(found.settings.optimised)
        return found.settings.command(folder)
    finally:
        shutil.move(folder / "kept.sqlite", folder / "run.sqlite")


def read_comparison(path):
    file = path.parent.parent / "compared" / "compare.json"
    whole = file.read_bytes()
    try:
        shutil.copy(path, file)
        begin(plan(file.parent))
    finally:
        file.write_bytes(whole)


READERS = {
    "settings.json": read_stored_settings,
    "triage.json": read_triage,
    "regions.json": read_regions,
    "confirmation-esmini.json": read_confirmation,
    "sensitivity.json": lambda path: read_sensitivity(path, "0" * 64),
    "not-exported.json": lambda path: not_exported(path.parent),
    "critical/0001.json": lambda path: (
        exported_scenarios(path.parent.parent, 60),
        read_facts(path),
    ),
    "compare.json": read_comparison,
}


def places(value, at=()):
    """Yield the path to every value in a record."""
    if at:
        yield at
    if isinstance(value, dict | list):
        for key in value if isinstance(value, dict) else range(len(value)):
            yield from places(value[key], (*at, key))


def damaged(record, place, text):
    """Return the text of a record with another at a place."""
    copy = json.loads(json.dumps(record))
    one = copy
    for key in place[:-1]:
        one = one[key]
    one[place[-1]] = MARK
    return json.dumps(copy).replace(f'"{MARK}"', text)


@pytest.mark.parametrize("name", READERS)
def test_whole_records_are_read(run, name):
    READERS[name](run / name)


@pytest.mark.parametrize("name", READERS)
@settings(
    max_examples=120, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_a_damaged_value_is_one_error(run, name, data):
    path: Path = run / name
    whole = path.read_bytes()
    record = json.loads(whole)
    place = data.draw(st.sampled_from(list(places(record))))
    value = data.draw(st.sampled_from(list(VALUES)))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    problems: tuple[str, ...] = ()
    try:
        path.write_text(damaged(record, place, VALUES[value]), "utf-8")
        READERS[name](path)
    except BridgeGenError as error:
        problems = error.problems
    finally:
        path.write_bytes(whole)
    assert problems or value not in NEVER, place
    assert all(len(problem) < 10_000 for problem in problems)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 300_000  # KiB


def test_an_error_does_not_quote_a_long_text(run):
    path = run / "confirmation-esmini.json"
    whole = path.read_bytes()
    try:
        path.write_text(damaged(json.loads(whole), ("simulator",), VALUES["long text"]), "utf-8")
        with pytest.raises(BridgeGenError) as caught:
            READERS[path.name](path)
    finally:
        path.write_bytes(whole)
    assert len(str(caught.value)) < 1000


@pytest.mark.parametrize("name", [name for name in READERS if name != "settings.json"])
@pytest.mark.parametrize("text", ["", "null", "[]", "7", '"x"', "{", "[" * 10**5, "\0"])
def test_what_is_no_record_is_one_error(run, name, text):
    path = run / name
    whole = path.read_bytes()
    try:
        path.write_text(text, "utf-8")
        if name == "not-exported.json" and text == "[]":
            assert READERS[name](path) == ()
        else:
            with pytest.raises(BridgeGenError):
                READERS[name](path)
    finally:
        path.write_bytes(whole)


@pytest.mark.parametrize(
    "name", ["triage.json", "regions.json", "confirmation-esmini.json", "sensitivity.json"]
)
def test_what_never_ends_is_refused(tmp_path, name):
    """A link to a device, as a folder from a stranger may hold one."""
    (tmp_path / name).symlink_to("/dev/zero")
    with refuses(BridgeGenError):
        READERS[name](tmp_path / name)


def test_a_scenario_of_an_evaluation_that_is_not_there(run):
    with refuses(BridgeGenError):
        exported_scenarios(run, 1)
