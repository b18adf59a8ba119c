"""The argument is well formed by the notation's rules, and says what the rows say."""

import re
import sqlite3

import pytest
from tests.approval import approve

import bridgegen as bg
from bridgegen.results.confirmation.record import (
    Change,
    Differences,
    Outcome,
    Record,
    Scenario,
    digest_of,
    write_record,
)
from bridgegen.scenario.language.thresholds import Thresholds

RUNS = ["fails", "unlucky", "clean", "judged", "all"]
PREFIXES = {
    "Goal": "G", "Strategy": "S", "Solution": "Sn", "Context": "C", "Assumption": "A",
    "Justification": "J", "CounterGoal": "CG", "CounterSolution": "CSn",
}  # fmt: skip
GOALS, SOLUTIONS = {"Goal", "CounterGoal"}, {"Solution", "CounterSolution"}
CONTEXTS = {"Context", "Assumption", "Justification"}
ENDS = {
    "SupportedBy": {
        *((a, b) for a in ("Goal", "Strategy") for b in ("Goal",)),
        ("Goal", "Strategy"), ("Goal", "Solution"),
        ("CounterGoal", "CounterGoal"), ("CounterGoal", "CounterSolution"),
    },
    "InContextOf": {(a, b) for a in ("Goal", "Strategy") for b in CONTEXTS},
    "Challenges": {("CounterGoal", "Goal"), ("CounterSolution", "Goal")},
}  # fmt: skip


@pytest.fixture(params=RUNS)
def argued(request, cases):
    return cases[request.param].case


@pytest.mark.thorough
def test_relations_are_those_that_the_notation_has(argued):
    kinds = {one.id: one.kind for one in argued.elements}
    for one in argued.relations:
        assert (kinds[one.source], kinds[one.target]) in ENDS[one.kind], one


def test_no_argument_goes_in_circles(argued):
    below = {one.id: [] for one in argued.elements}
    for one in argued.relations:
        ends = (one.source, one.target)
        upper, lower = ends[::-1] if one.kind == "Challenges" else ends
        below[upper].append(lower)
    seen: list[str] = []

    def descend(name, above):
        assert name not in above
        seen.append(name)
        for one in below[name]:
            descend(one, {*above, name})

    descend(argued.elements[0].id, set())
    assert sorted(seen) == sorted(below)  # a tree: each element once, and all of them


def test_every_goal_is_supported_or_undeveloped_or_defeated(argued):
    for one in argued.elements:
        supports = list(argued.targets(one.id, "SupportedBy"))
        challenged = list(argued.challengers(one.id))
        if one.kind in GOALS:
            assert bool(supports) + one.undeveloped + bool(challenged) == 1, one.id
            assert one.status
        elif one.kind == "Strategy":
            assert supports
        else:
            assert not supports
            assert not one.status


def test_solutions_have_evidence_and_all_evidence_is_used(argued):
    used = {name for one in argued.elements for name in one.evidence}
    assert all(one.evidence for one in argued.elements if one.kind in SOLUTIONS)
    assert used <= {one.id for one in argued.evidence}
    assert {one.id for one in argued.evidence if one.command} <= used


def test_ids_say_the_kind_and_the_place(argued):
    for one in argued.elements:
        assert re.fullmatch(rf"{PREFIXES[one.kind]}\d+(\.\d+)*", one.id)


def test_no_place_of_a_number_is_left_open(argued):
    known = {one.id for one in argued.numbers}
    for element in argued.elements:
        for said in (element.statement, *element.details):
            assert not re.search(r"\{(R\d+|all)\.", said.text)
            assert {*re.findall(r"\{([^}]+)\}", said.template)} <= known


def test_every_number_of_a_run_is_said(argued):
    said = {
        name
        for one in argued.elements
        for text in (one.statement, *one.details)
        for name in re.findall(r"\{([^}]+)\}", text.template)
    }
    said |= {one.holds.number for one in argued.elements if one.holds}
    rest = {one.id for one in argued.numbers} - said
    assert {name.partition(".")[2] for name in rest} <= {"pairs_all"}


def statuses(case):
    return {one.id: one.status for one in case.elements if one.kind == "Goal"}


def test_a_run_with_failures_is_not_dressed_up(cases, made):
    case, triage = cases["fails"].case, bg.Run(made["fails"]).triage
    found = statuses(case)
    assert found["G1"] == found["G1.3"] == "not supported"
    assert case.element("G1.3").declaration == "defeated"
    (counter,) = case.challengers("G1.3")
    assert f": {triage.bound.harmful} of 200 evaluations" in counter.statement.text
    below = [one for one in case.targets(counter.id, "SupportedBy") if one.kind == "CounterGoal"]
    assert len(below) == min(len(triage.modes), 10)
    for one, mode in zip(below, triage.modes, strict=False):
        assert mode.title in one.statement.text
        assert ("robust" in one.statement.text) == (not mode.knife_edge)


def test_failures_of_fresh_draws_are_failures_too(cases, made):
    """A search that finds nothing does not hide what the draws of its bound find."""
    case, triage = cases["unlucky"].case, bg.Run(made["unlucky"]).triage
    assert triage.bound.harmful == 0
    assert triage.bound.space.harmful > 0
    assert statuses(case)["G1.3"] == statuses(case)["G1"] == "not supported"
    (counter,) = case.challengers("G1.3")
    assert counter.statement.text.startswith(f"{triage.bound.space.harmful} failures of ")


def test_a_run_without_failures_leaves_open_what_it_cannot_know(cases):
    case = cases["clean"].case
    found = statuses(case)
    assert found == {
        "G1": "incomplete", "G1.1": "supported", "G1.2": "supported", "G1.3": "supported",
        "G1.4": "supported", "G1.5": "undeveloped", "G1.6": "incomplete",
        "G1.6.1": "undeveloped", "G1.6.2": "undeveloped", "G1.7": "undeveloped",
    }  # fmt: skip
    # By hand: (1 - p) ** 200 = 0.025 gives 1.8275 %.
    approve(case.element("G1.4").statement.text, "1.83")


def test_a_violated_requirement_defeats_its_goal_alone(cases, made):
    case, criteria = cases["judged"].case, bg.Run(made["judged"]).criteria
    found = statuses(case)
    assert (found["G1.5.1"], found["G1.5.2"]) == ("not supported", "supported")
    assert found["G1"] == found["G1.5"] == "not supported"
    assert found["G1.3"] == "supported"
    (counter,) = case.challengers("G1.5.1")
    approve(counter.statement.text, "12", criteria[0].violated)


def test_collisions_that_do_not_count_are_said(cases, made):
    frame = bg.Run(made["judged"]).frame()
    spared = ((frame["n_collision"] > 0) & (frame["harm"] < 0.3)).sum()
    text = cases["judged"].case.element("C1.3.1").statement.text
    assert spared > 0
    assert f"responsible: {(frame['n_collision'] > 0).sum()}." in text
    approve(text, spared)


def confirmed_in_double(folder, there):
    """Write a confirmation of as many exported scenarios: critical, not critical, or not run."""
    run = bg.Run(folder)
    rows, scenarios = run.rows(), []
    for kept, critical in zip(run.exported(), there, strict=False):
        k, here = kept.evaluation, Outcome(critical=True, d_min=0.0, v_d=1.0, n_collision=1.0, F=())
        ran = {} if critical is None else {
            "there": here.model_copy(update={"critical": critical}),
            "change": Change.between(here, here), "differences": Differences(),
        }  # fmt: skip
        digest = digest_of(rows.X[k], rows.metrics[k])
        scenarios.append(Scenario(evaluation=k, name=kept.name, row=digest, here=here, **ran))
    record = Record(
        simulator="double", label="double 1", settings={}, reference="embedded", run=str(folder),
        scenario="", ego="", thresholds=Thresholds(), objectives=(), scenarios=tuple(scenarios),
    )  # fmt: skip
    write_record(folder, record)


@pytest.mark.parametrize(
    ("there", "status", "said"),
    [
        ((True, True), "supported", "2 of 2"),
        ((True, False), "not supported", "1 of 2"),
        ((True, None), "supported", "1 of 1"),
        ((None, None), "undeveloped", "0 of 0"),
    ],
)
def test_a_confirmation_is_evidence_of_what_ran_there(run, checked, there, status, said):
    folder = run("fails")
    confirmed_in_double(folder, there)
    made = bg.export_safety_case([folder])
    one = made.case.element("G1.6.1.1")
    assert (one.status, one.undeveloped) == (status, status == "undeveloped")
    assert said in one.statement.text
    assert statuses(made.case)["G1.6"] == (
        "not supported" if status == "not supported" else "incomplete"
    )
    assert checked(made.folder) == (0, [], "")


def test_a_run_without_any_result_supports_nothing(run, checked):
    """As if every simulation had failed; its triage is made of the same rows again."""
    folder = run("judged")
    with sqlite3.connect(folder / "run.sqlite") as connection:
        names = [row[1] for row in connection.execute("PRAGMA table_info(evaluations)")]
        metrics = names[names.index("r_red") : names.index("f0")]
        nothing = ", ".join(f'"{name}" = NULL' for name in metrics)
        connection.execute(f"UPDATE evaluations SET status = 2, critical = 0, {nothing}")
    connection.close()
    bg.resume(folder)
    made = bg.export_safety_case([folder])
    found = statuses(made.case)
    assert found["G1.1"] == "not supported"
    assert found["G1.3"] == found["G1.5.1"] == found["G1.4"] == "undeveloped"
    assert checked(made.folder) == (0, [], "")


def test_several_runs_are_one_case_with_a_goal_each(cases):
    case = cases["all"].case
    found = statuses(case)
    bad, rest = "not supported", "incomplete"
    assert [found[f"G1.{k}"] for k in (1, 2, 3, 4)] == [bad, bad, rest, bad]
    assert found["G1"] == "not supported"
    # Four intervals of 95 % hold together with 80 % at least.
    assert "at least 80 %" in case.element("J1.1").statement.text


def test_the_context_says_what_was_searched_and_by_what(cases):
    case = cases["clean"].case
    lines = [text.text for text in case.element("C1.1").details]
    assert any(line.startswith("parameter ego_speed: participants, ") for line in lines)
    assert any(line.startswith("constraint ") for line in lines)
    approve(case.element("C1.4").statement.text, "BridgeGen", "200")
    approve(case.element("C1.2").statement.text, "precipitation")
    places = [one.link for one in case.elements if one.kind == "Assumption" and one.link]
    assert all(one.startswith("limits.md#") for one in places)


def test_sacm_s_words(argued):
    for one in argued.relations:
        kinds = (argued.element(one.source).kind, argued.element(one.target).kind)
        assert one.counter == (one.kind == "Challenges")
        if one.kind == "InContextOf":
            assert one.sacm == "AssertedContext"
        else:
            evidence = bool({*kinds} & SOLUTIONS)
            assert one.sacm == ("AssertedEvidence" if evidence else "AssertedInference")
    for one in argued.elements:
        assert (one.declaration != "") == (one.sacm == "Claim")
        if one.undeveloped:
            assert one.declaration == "needsSupport"
