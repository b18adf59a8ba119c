"""The region with evidence: what spans it, who warns beyond it, and what is not said without."""

import json
import sqlite3

import numpy as np
import pytest
from tests.safety_case.test_argument import confirmed_in_double

import bridgegen as bg
from bridgegen.cli.terminal.search import verdict_lines
from bridgegen.jobs.search import SearchCallbacks
from bridgegen.jobs.search.exported import exported_scenarios
from bridgegen.jobs.suite.growth import add_failures
from bridgegen.jobs.suite.known_failures import words
from bridgegen.results.failures import read_failures
from bridgegen.results.validated import Region, Validated, extrapolated

pytestmark = pytest.mark.thorough

REGION = Region(
    scenario="s", fingerprint="f", vehicle="kinematic", evidence="3 rows confirmed in double",
    ranges={"speed": (5.0, 20.0, "m/s"), "gap": (1.0, 2.0, "1")},
)  # fmt: skip


def test_findings_beyond_the_region_are_counted_and_named_by_the_farthest():
    X = np.array([[5.0, 2.0], [23.0, 1.5], [21.0, 0.5], [20.0, 1.0]])
    rows, said = extrapolated([REGION], "f", "kinematic", ["speed", "gap"], X)
    assert rows.tolist() == [1, 2]
    assert said == (
        "2 of 4 findings lie outside the region for which the models were validated: "
        "speed 5 to 20 m/s, finding 23; gap 1 to 2, finding 0.5. It is that of 3 rows confirmed "
        "in double"
    )


@pytest.mark.parametrize(
    ("vehicle", "regions", "n"), [("kinematic", [], 0), ("other", [REGION], 1)]
)
def test_without_any_region_nothing_is_said_and_of_another_vehicle_none_holds(vehicle, regions, n):
    X = np.array([[5.0, 2.0]])
    rows, said = extrapolated(regions, "f", vehicle, ["speed", "gap"], X)
    assert len(rows) == n
    assert said == "this scenario is outside all regions that are validated" * n
    assert extrapolated(regions, "f", vehicle, ["speed", "gap"], X[:0])[1] == ""


def test_a_warning_is_no_longer_than_its_record_takes():
    hostile = REGION.model_copy(update={"evidence": "x" * 2000})
    assert len(extrapolated([hostile], "f", "kinematic", ["speed"], np.array([[99.0]]))[1]) == 2000


def value(run, row: int, name: str) -> float:
    with sqlite3.connect(run / "run.sqlite") as connection:
        (found,) = connection.execute(f"SELECT {name} FROM evaluations WHERE id = ?", [row])
    connection.close()
    return found[0]


def item(found, id: str):
    return next(one for one in found.dossier.items if one.id == id)


def test_confirmed_rows_and_accepted_tests_span_it(project, recomputed):
    """Rows that are not confirmed do not, nor does one whose test is accepted and refused."""
    run, out = project / "hangs", project / "out"
    confirmed_in_double(run, [True, True, False, None])
    rows = [one.evaluation for one in exported_scenarios(run)]
    tested = next(row for row in range(100) if row not in rows)
    v = [value(run, row, "v_d") for row in (tested, rows[2])]
    d = value(run, rows[2], "d_min")
    out.mkdir()
    (out / "measured.csv").write_text(
        "run,scenario,quantity,unit,measured,uncertainty,threshold,series\n"
        f"hangs,evaluation {tested + 1},v_d,m/s,{v[0]!r},,1,\n"
        f"hangs,0003,v_d,m/s,{v[1]!r},,1,\nhangs,0003,d_min,m,{d + 5.0!r},,1,\n"
    )
    found = bg.export_credibility([project], out=out)
    (region,) = found.dossier.validated
    assert region.scenario == "cut-out"
    assert region.evidence.startswith("1 rows accepted beside real tests with route-follower, 2 ")
    for name, (low, high, _) in region.ranges.items():
        span = [value(run, row, name) for row in (*rows[:2], tested)]
        assert (low, high) == (min(span), max(span))
    one = item(found, "10.2")
    assert one.status == "partly"
    assert any(line.text.startswith("R1: ") or "outside" in line.text for line in one.details)
    assert Validated.model_validate_json((out / "validated.json").read_bytes()).regions == (region,)
    assert recomputed(out) == (0, [], "")
    data = json.loads(found.file.read_text("utf-8"))
    next(iter(data["validated"][0]["ranges"].values()))[1] += 1.0
    found.file.write_text(json.dumps(data), "utf-8")
    status, lines, _ = recomputed(out)
    assert status == 1
    assert "region of cut-out" in lines[0]


def test_without_evidence_the_dossier_says_so_once(made, tmp_path):
    found = bg.export_credibility([made["clean"]], out=tmp_path)
    assert item(found, "10.2").status == "gap"
    assert [gap.place for gap in found.dossier.gaps if "No region is validated" in gap.why] == [
        "10.2"
    ]
    assert Validated.model_validate_json((tmp_path / "validated.json").read_bytes()).regions == ()


GIVEN = {"ego": "route-follower", "budget": 60, "triage": "short", "causes": False, "keep": 3}


def test_a_run_beside_a_dossier_warns_in_terminal_report_and_suite(tmp_path):
    first = bg.run_search("cut-in", **GIVEN, out=tmp_path / "runs" / "a")
    assert first.triage.extrapolated == ""
    settings = first.settings
    region = REGION.model_copy(
        update={"fingerprint": settings.fingerprint, "ranges": {"ego_speed": (1.0, 2.0, "m/s")}}
    )
    (tmp_path / "dossier").mkdir()
    file = tmp_path / "dossier" / "validated.json"
    file.write_text(Validated(regions=(region,)).model_dump_json())
    run = bg.run_search("cut-in", **GIVEN, out=tmp_path / "runs" / "b")
    n = len(exported_scenarios(run.folder))
    said = run.triage.extrapolated
    assert said.startswith(f"{n} of {n} findings lie outside the region")
    assert {*run.triage.beyond} == {one.evaluation for one in exported_scenarios(run.folder)}
    assert f"Extrapolated: {said}" in verdict_lines(run, 1.0)
    assert said in run.report.read_text("utf-8")
    add_failures([run.folder], tmp_path / "suite")
    failures = read_failures(tmp_path / "suite").failures
    assert {one.note for one in failures.values()} == {"outside the validated region"}
    id, failure = next(iter(failures.items()))
    assert words("new", (id, failure)) == "new failure, outside the validated region"
    assert words("passed", (id, failure)) == ""
    file.write_text('{"regions": 3}')
    warned: list[str] = []
    callbacks = SearchCallbacks(warning=warned.append)
    run = bg.run_search("cut-in", **GIVEN, out=tmp_path / "runs" / "c", callbacks=callbacks)
    assert run.triage.extrapolated == ""
    assert any("validated.json: must be what 'bridgegen credibility' writes" in w for w in warned)


def test_a_verdict_that_hangs_on_the_time_step_is_kept_with_that_note(project, tmp_path):
    """A check of an exported finding is changed: no failure at half of the step."""
    path = project / "hangs" / "triage.json"
    data = json.loads(path.read_text("utf-8"))
    exported = {one.evaluation: one.name for one in exported_scenarios(path.parent)}
    check = next(one for one in data["step_checks"] if one["evaluation"] in exported)
    check["at"][1]["harmful"] = False
    path.write_text(json.dumps(data), "utf-8")
    name = exported[check["evaluation"]]
    (made,) = add_failures([path.parent / "critical" / f"{name}.xosc"], tmp_path / "suite")
    assert made.reason == "depends on the time step"
    (failure,) = read_failures(tmp_path / "suite").failures.values()
    assert failure.note == "depends on the time step"
