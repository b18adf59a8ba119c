"""A run says whether what its scenario is about happened."""

import json
import sqlite3
from pathlib import Path

import pytest

from bridgegen.base.errors import StorageError
from bridgegen.cli.verdict.of_run import PassFailCriteria, figures_of
from bridgegen.jobs.search import Run, SearchCallbacks, run_search

DOUBLE_PARKED = Path(__file__).parent / "double-parked.yaml"


@pytest.fixture(scope="module")
def stuck_run(tmp_path_factory) -> Run:
    """`reference` passes no vehicle that stands in its lane where one comes the other way."""
    return run_search(
        DOUBLE_PARKED, algorithm="random", budget=60, seed=3, causes=False, triage="none",
        out=tmp_path_factory.mktemp("runs") / "van",
    )  # fmt: skip


def test_a_run_whose_ego_stands_behind_a_van_did_not_happen(stuck_run):
    found = stuck_run.happening
    assert found.rows == 60
    assert not found.happened
    assert found.behind == "delivery"
    assert found.stuck is not None
    assert found.stuck > 40
    assert found.reasons == (found.stuck_in_words,)
    # The van's rear is at about 108 m; the ego's front starts at about 34 m.
    assert 60.0 < found.driven < 80.0
    assert found.end is not None
    assert found.end.rows == 0
    assert {one.name for one in found.events} == {"hazards_on", "steps_out"}


def test_stuck_is_a_figure_and_not_a_harm(stuck_run):
    assert figures_of(stuck_run)["stuck"] == stuck_run.happening.stuck
    assert stuck_run.summary.critical == 0
    outcomes = PassFailCriteria.read(["stuck > 0"], None).judge(stuck_run)
    assert [one.verdict for one in outcomes] == ["unknown", "failed"]
    assert stuck_run.verdict == "not judged"


def test_the_report_has_it(stuck_run):
    page = stuck_run.report.read_text()
    assert "The scenario did not happen" in page
    assert "Who came near the ego" in page


def test_it_is_recorded_by_row(stuck_run):
    db = sqlite3.connect(stuck_run.folder / "run.sqlite")
    texts = [text for (text,) in db.execute("SELECT happened FROM evaluations")]
    rows = db.execute(
        "SELECT count(*) FROM evaluations WHERE json_extract(happened, '$.stuck.behind') NOT NULL"
    ).fetchone()[0]
    db.close()
    assert rows == sum(bool(json.loads(one)["stuck"]) for one in texts) == stuck_run.happening.stuck


def test_a_motorway_driver_at_a_crossroads_is_named_before_the_search_and_after(tmp_path):
    said, stages = list[str](), list[str]()

    def warning(text: str) -> None:
        said.append(text)
        stages.append("said")

    run = run_search(
        "crossroads-s4", ego="un-r157", algorithm="random", budget=20, triage="none",
        causes=False, out=tmp_path / "run",
        callbacks=SearchCallbacks(stage=stages.append, warning=warning),
    )  # fmt: skip
    (text,) = [one for one in said if "domain" in one]
    assert "junctions" in text
    assert stages.index("said") < stages.index("compile")
    for found in (run.happening, Run(tmp_path / "run").happening):
        assert found.domain == text
        assert found.sentence.endswith(text)
        assert found.happened


@pytest.mark.parametrize("text", ["{", "[1]", '{"began": 3}', '{"began":{},"near":{},"stuck":{}}'])
def test_a_damaged_text_is_an_error_of_the_store(tmp_path, text):
    run_search(
        "cut-in", algorithm="random", budget=4, triage="none", causes=False, deliver=False,
        out=tmp_path / "run",
    )  # fmt: skip
    db = sqlite3.connect(tmp_path / "run" / "run.sqlite")
    db.execute("UPDATE evaluations SET happened = ? WHERE id = 2", [text])
    db.commit()
    db.close()
    with pytest.raises(StorageError, match="damaged"):
        _ = Run(tmp_path / "run").happening
