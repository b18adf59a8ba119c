"""What could not be judged is no pass: in suites, differences, files, runs and safety cases."""

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest
from tests.approval import approve
from tests.campaign.braking import deterministic, scenario_text, write_pair
from tests.results.test_failures import failure

import bridgegen as bg
from bridgegen.assess.conflict.happening import Happening, Share
from bridgegen.cli.verdict.of_difference import DifferenceCriteria
from bridgegen.cli.verdict.of_run import PassFailCriteria
from bridgegen.cli.verdict.of_suite import SuiteCriteria, figures_of
from bridgegen.engine.simulate import simulate_file
from bridgegen.jobs.dashboard.home import Home
from bridgegen.jobs.suite.difference import DriverDifference, difference
from bridgegen.jobs.suite.entries import RESULTS
from bridgegen.jobs.suite.known_failures import KnownFailures
from bridgegen.jobs.suite.replay import replay
from bridgegen.jobs.suite.results import EntryResult, RowResult
from bridgegen.jobs.suite.suite import SuiteRun, evaluate_suite, read_suite
from bridgegen.results.failures import read_failures, write_failures

DOUBLE_PARKED = Path(__file__).parents[1] / "campaign" / "double-parked.yaml"

BEYOND_TYRES = scenario_text().replace('maxDeceleration="9"', 'maxDeceleration="100"')

KEPT = RowResult(d_min=3.0)
HIT = RowResult(critical=True, harm=0.5, collisions=1.0)
LOST = RowResult(problem="it diverges")
JUMP = RowResult(collisions=1.0, implausible="jump")
UNSAFE = RowResult(collisions=1.0, unsafe_start=True)


def entry(*rows: RowResult, name: str = "a", ego: str = "one", stuck: bool = False) -> EntryResult:
    return EntryResult(
        entry=name, ego=ego, digest="", scenario=f"{name}.xosc", driver=ego, rows=list(rows),
        not_happened=["stuck in 2 of 2"] if stuck else [],
    )  # fmt: skip


def suite_of(*results: EntryResult) -> SuiteRun:
    egos = tuple(dict.fromkeys(one.ego for one in results))
    return SuiteRun(Path("suites/some"), egos, results, {})


# ---- the rule ----


@pytest.mark.parametrize(
    ("rows", "verdict", "why"),
    [
        ((KEPT, JUMP), "passed", ""),
        ((KEPT, JUMP, UNSAFE), "not judged",
         "only 1 of 3 variations could be judged: 1 × implausible traffic (jump), "
         "1 × no time to act from the start on"),
        ((JUMP, JUMP), "not judged",
         "none of 2 variations could be judged: 2 × implausible traffic (jump)"),
        ((JUMP,), "not judged", "implausible traffic (jump)"),
        ((HIT, JUMP, JUMP), "failed", None),
        ((LOST, JUMP, JUMP), "not run", None),
        ((JUMP.model_copy(update={"margins": [-1.0]}),), "failed", None),
        # A clause judges by whether the models collide, too; not what could not happen.
        ((UNSAFE.model_copy(update={"clauses": "u"}),), "passed", ""),
        ((JUMP.model_copy(update={"clauses": "x"}),), "not judged", None),
        ((), "not run", ""),
    ],
)  # fmt: skip
def test_half_of_the_variations_must_be_judged(rows, verdict, why):
    one = entry(*rows)
    assert one.verdict == verdict
    if why is not None:
        assert one.unjudged == why


def test_nothing_passes_in_a_scenario_that_did_not_happen():
    one = entry(KEPT, KEPT, stuck=True)
    assert (one.verdict, one.count("passed"), one.count("not judged")) == ("not judged", 0, 2)
    approve(one.unjudged)
    assert entry(KEPT, HIT, stuck=True).verdict == "failed"
    assert (
        one.model_copy(update={"rows": [KEPT.model_copy(update={"clauses": "pu"})]}).letters(0)
        + one.letters(0)
        == "xnn"
    )


def test_of_few_evaluations_one_event_of_several_need_not_begin():
    """A storyboard may have an event for a case that does not arise: 0 of 1 is not below 2 %."""
    began, never = Share("cuts_in", 1, 1), Share("brakes", 0, 1)
    assert Happening(1, events=(began, never)).happened
    assert not Happening(1, events=(never,)).happened
    many = (Share("cuts_in", 50, 50), Share("brakes", 0, 50))
    assert not Happening(50, events=many).happened


def test_results_of_earlier_versions_can_be_read():
    one = EntryResult.model_validate(
        {"entry": "a", "ego": "", "digest": "", "scenario": "a.xosc", "rows": [{"d_min": 2.0}]}
    )
    assert (one.verdict, one.not_happened, one.rows[0].unsafe_start) == ("passed", [], False)


def test_results_of_earlier_versions_are_not_taken_for_passes(tmp_path):
    out = tmp_path / "out"
    evaluate_suite(DOUBLE_PARKED, samples=3, out=out, workers=1)
    file = out / RESULTS
    header, line = file.read_text().splitlines()
    before = json.loads(line)
    del before["not_happened"], before["outside"]
    file.write_text(f"{header}\n{json.dumps(before)}\n")
    assert read_suite(out).results[0].verdict == "passed"  # it is read as it was
    assert evaluate_suite(DOUBLE_PARKED, samples=3, out=out, workers=1).results[0].unjudged


# ---- suites ----


def test_an_entry_that_is_not_judged_leaves_no_condition_passed():
    suite = suite_of(entry(KEPT), entry(JUMP, name="b"))
    (one,) = SuiteCriteria.read([]).judge(suite)
    assert (one.verdict, one.details) == (
        "unknown", "0 of 2 fail, 1 pass, 1 not judged; b: implausible traffic (jump)"
    )  # fmt: skip
    figures = figures_of(suite)
    assert (figures["not_judged"], figures["not_judged_entries"], figures["passed"]) == (1, 1, 1)

    def verdicts(*texts: str) -> list[str]:
        return [each.verdict for each in SuiteCriteria.read(texts).judge(suite)]

    assert verdicts("failed > 0", "collisions > 0") == ["unknown", "failed"]
    assert verdicts("failed > 0", "not_judged_entries > 1") == ["passed", "passed"]
    assert verdicts("not_judged > 0") == ["failed"]


def test_a_known_failure_that_is_not_judged_is_not_gone():
    known = KnownFailures({})
    assert known.worst(entry(JUMP)) == "not judged"
    assert known.worst(entry(KEPT, stuck=True)) == "not judged"
    assert known.worst(entry(KEPT, JUMP)) == "passed"


@pytest.fixture
def odd(tmp_path) -> Path:
    """Two variations of a file; the lead vehicle brakes by 60 and 80 m/s², tyres allow about 10."""
    values = '<DistributionSet><Element value="60"/><Element value="80"/></DistributionSet>'
    body = deterministic(("Deceleration", values))
    _, ranges = write_pair(tmp_path / "files", body, BEYOND_TYRES)
    return ranges


def test_collisions_in_implausible_traffic_are_no_pass(cli, odd, tmp_path):
    words = ("suite", odd, "--ego", "route-follower", "--workers", 1, "--out", tmp_path / "out")
    code, out, err = cli(*words, "--junit", tmp_path / "j.xml")
    assert code == 3
    assert "NOT JUDGED, 2 collide" in out
    assert "1 is not judged; of their variations 0 pass, 0 fail, 2 not judged" in out
    why = "none of 2 variations could be judged: 2 × implausible traffic (deceleration beyond"
    assert why in out
    assert "NOT JUDGED: variations with route-follower (0 of 2 fail, 0 pass, 2 not judged" in err
    root = ElementTree.parse(tmp_path / "j.xml").getroot()
    assert (root.get("tests"), root.get("failures"), root.get("errors")) == ("2", "0", "1")
    code, out, _ = cli(*words, "--json")
    (one,) = json.loads(out)["entries"]
    assert code == 3
    assert (one["verdict"], one["not_judged"], one["standing"]) == ("not judged", 2, "not judged")
    assert one["unjudged"].startswith(why)
    assert cli(*words, "--fail-if", "failed > 0")[0] == 3


def test_an_ego_that_stands_behind_a_van_is_not_judged(cli, tmp_path):
    words = (DOUBLE_PARKED, "--samples", 8, "--workers", 1)
    code, out, err = cli("suite", *words, "--out", tmp_path / "out")
    assert code == 3
    approve(out, "scenario")
    approve(err, "judged")
    egos = ("--ego", "reference", "--ego", "careful", "--budget", 0)
    code, out, err = cli("diff", *words, *egos, "--out", tmp_path / "diff")
    assert code == 3
    assert "both pass       0" in out
    assert "not comparable  9" in out
    approve(err, "double-parked")


def test_a_kept_failure_passes_where_the_ego_stops_for_what_it_hit(tmp_path):
    """A file of a collision with what stands: stopping behind it is what the fix is for."""
    out = tmp_path / "out"
    evaluate_suite(DOUBLE_PARKED, samples=0, out=out, workers=1)
    (file,) = [one for one in replay(out, "double-parked", 1).files if one.suffix == ".xosc"]
    alone = evaluate_suite(file, out=tmp_path / "alone", workers=1)
    assert [one.unjudged[:48] for one in alone.results] == [
        "the scenario did not happen: stuck in 1 of 1: st"
    ]
    approve(simulate_file(file).unjudged, "stands")
    fixed = failure("b", files=[file.name], status="fixed")
    write_failures(read_failures(file.parent), {"b": fixed})
    kept = evaluate_suite(file, out=tmp_path / "kept", workers=1)
    assert [one.verdict for one in kept.results] == ["passed"]


def test_a_driver_outside_its_domain_passes_nowhere(tmp_path, cli):
    """In a search, a suite and a simulation alike."""
    words = ("lead-brakes", "--samples", 2, "--workers", 1, "--ego")
    assert cli("suite", *words, "un-r157", "--out", tmp_path / "motorway")[0] == 0
    town = ("crossroads-s1", *words[1:], "un-r157", "--out", tmp_path / "town")
    code, out, _ = cli("suite", *town)
    assert code == 3
    approve(out, "un-r157", "crossroads-s1")
    (file,) = [one for one in replay(tmp_path / "town", "crossroads-s1", 1).files
               if one.suffix == ".xosc"]  # fmt: skip
    approve(simulate_file(file).unjudged, "un-r157")
    assert simulate_file(file, ego="careful").unjudged == ""


# ---- differences ----


def test_what_is_not_judged_is_not_compared():
    first = [entry(KEPT, KEPT, JUMP, HIT), entry(KEPT, KEPT, name="b")]
    second = [entry(HIT, JUMP, JUMP, HIT, ego="two"), entry(KEPT, KEPT, name="b", ego="two",
                                                           stuck=True)]  # fmt: skip
    found = difference(first, second, ("one", "two"))
    assert found.counts == {
        "broken": 1, "fixed": 0, "both fail": 1, "both pass": 0, "not comparable": 4,
    }  # fmt: skip
    assert found.unjudged == {"b": "none of 2 variations could be compared"}
    suite = suite_of(*first, *second)

    def verdicts(*texts: str) -> list[str]:
        made = DriverDifference(suite, found, (), Path())
        return [one.verdict for one in DifferenceCriteria.read(texts).judge(made)]

    assert verdicts() == ["unknown"]
    assert verdicts("broken > 0", "fixed > 0") == ["failed", "unknown"]
    assert verdicts("fixed > 0", "not_judged_entries > 1") == ["passed", "passed"]
    same = difference(first[:1], second[:1], ("one", "two"))
    assert DifferenceCriteria.read([]).judge(DriverDifference(suite, same, (), Path())) == ()


def test_the_junit_of_a_difference_calls_an_error_what_could_not_be_compared(tmp_path):
    first, second = entry(JUMP), entry(JUMP, ego="two")
    suite, found = suite_of(first, second), difference([first], [second], ("one", "two"))
    outcomes = DifferenceCriteria.read([], tmp_path / "j.xml").judge(
        DriverDifference(suite, found, (), tmp_path)
    )
    assert [one.verdict for one in outcomes] == ["unknown", "passed"]
    errors = ElementTree.parse(tmp_path / "j.xml").getroot().findall(".//error")
    assert [one.get("message") for one in errors] == [
        "it could not be compared; one: implausible traffic (jump); two: implausible traffic (jump)"
    ]


# ---- files, runs, safety cases ----


def test_a_file_in_implausible_traffic_passes_no_condition(cli, tmp_path):
    text = BEYOND_TYRES.replace('"double" value="6"', '"double" value="80"')
    file, _ = write_pair(tmp_path / "files", text=text)
    words = ("simulate", file, "--ego", "route-follower")
    code, out, _ = cli(*words)
    assert code == 0  # nothing was asked
    approve(out, "deceleration")
    code, _, err = cli(*words, "--fail-if", "d_min > 1")
    assert code == 3
    approve(err, "d_min")
    approve(cli(*words, "--fail-if", "n_collision > 0")[2], "n_collision")


@pytest.fixture(scope="module")
def stuck_run(tmp_path_factory) -> "bg.Run":
    return bg.run_search(
        DOUBLE_PARKED, algorithm="random", budget=20, seed=3, causes=False, triage="none",
        criteria=["C-1: always(ego.v < 50 m/s)"], out=tmp_path_factory.mktemp("runs") / "van",
    )  # fmt: skip


def test_a_run_that_is_not_judged_passes_no_condition(stuck_run, tmp_path):
    texts = ["critical > 0", "failed > 0", "stuck > 0"]
    outcomes = PassFailCriteria.read(texts, tmp_path / "j.xml").judge(stuck_run)
    # Whether evaluations failed is known all the same.
    assert [one.verdict for one in outcomes] == [
        "unknown", "unknown", "passed", "failed", "unknown",
    ]  # fmt: skip
    approve(outcomes[1].details, "scenario")
    root = ElementTree.parse(tmp_path / "j.xml").getroot()
    assert (root.get("errors"), root.get("failures")) == ("3", "1")


def test_a_safety_case_of_a_run_that_is_not_judged_ends_with_3(cli, stuck_run, tmp_path):
    code, out, err = cli("safety-case", stuck_run.folder, "--out", tmp_path / "case")
    assert code == 3
    status = {line.split()[0]: line.split()[1] for line in out.splitlines() if line[:1] == "G"}
    assert (status["G1.3"], status["G1.4"]) == ("undeveloped", "undeveloped")
    assert status["G1.5"] == "incomplete"  # although the criterion is met in each evaluation
    approve(err, "JUDGED", stuck_run.folder)


def test_a_list_of_runs_does_not_say_that_it_has_no_failures(stuck_run):
    view = Home(stuck_run.folder.parent)
    assert b'"unjudged":true' in view.page().replace(b" ", b"")
    pair = (view.pair(0, 0) or b"").replace(b"\n", b"")
    assert b"<td>not judged</td>" in pair
    assert b'<th scope="row">failure modes</th><td>\xe2\x80\x93</td>' in pair


# ---- tests of a protocol ----


@pytest.mark.parametrize(
    ("scenario", "ego", "fixed"),
    [("r157/stationary-vehicle", "un-r157", {}), ("ncap-aeb/ccrs", "reference", {"ego_speed": 4})],
)
def test_an_ego_that_stops_for_the_target_of_a_test_is_judged(scenario, ego, fixed, tmp_path):
    """UN R157, 5.2.4: it stops behind a stationary vehicle. Euro NCAP's CCRs: it touches none."""
    run = bg.run_search(
        scenario, ego=ego, fixed=fixed, algorithm="random", budget=20, seed=1, causes=False,
        triage="none", out=tmp_path / "run",
    )  # fmt: skip
    assert run.happening.stuck is not None
    assert run.happening.stuck == run.happening.may_stop > 10
    assert "stuck in" in run.happening.sentence  # and is still said
    approve(run.verdict)


def test_a_suite_judges_an_ego_that_stops_for_the_target_of_a_test(tmp_path):
    suite = evaluate_suite(
        "r157/stationary-vehicle", egos=["un-r157"], samples=8, out=tmp_path / "out", workers=1
    )
    assert [one.verdict for one in suite.results] == ["passed"]


def test_criteria_beside_harm_do_not_excuse_a_stuck_ego(tmp_path):
    """Such a criterion need not ask for what the scenario is about."""
    text = DOUBLE_PARKED.read_text() + "criteria:\n  - {id: C-1, formula: impact_speed < 1 m/s}\n"
    (tmp_path / "van.yaml").write_text(text)
    suite = evaluate_suite(tmp_path / "van.yaml", samples=8, out=tmp_path / "out", workers=1)
    assert [one.verdict for one in suite.results] == ["not judged"]
