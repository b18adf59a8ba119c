"""Failure modes over all results, with the status that a person sets."""

from dataclasses import replace
from pathlib import Path

import pytest

from bridgegen.jobs.dashboard.modes import (
    Decisions,
    decisions_of,
    failure_modes,
    undecided,
    unseen,
)
from bridgegen.jobs.dashboard.project import Project
from bridgegen.jobs.dashboard.results import Failure as Found
from bridgegen.jobs.dashboard.results import ModeKey
from bridgegen.results.failures import FILE, Failure, FailureFile
from bridgegen.scenario.language.criteria import CriterionSection


def file_of(**statuses):
    """Return decisions, by conflict type of cut-in, stack."""
    found = {}
    for kind, status in statuses.items():
        name = ModeKey("cut-in", "stack", "contact", kind).id
        found[name] = Failure(status=status, comment=f"about {kind}")
    return Decisions(found)


def test_a_mode_of_two_versions_is_one_mode(result):
    some = [result(version=v, time=t, modes=("turn",)) for v, t in (("1.1", 1.0), ("1.2", 2.0))]
    (mode,) = failure_modes(some, file_of())
    assert mode.versions == ("1.1", "1.2")
    assert (mode.fails_now, mode.status, mode.count) == (True, "new", 3)  # of the current result


def test_what_the_latest_version_does_not_have_fails_no_more(result):
    some = [result(version="1.1", time=1.0, modes=("turn",)), result(version="1.2", time=2.0)]
    (mode,) = failure_modes(some, file_of())
    assert not mode.fails_now
    assert mode.results == (some[0],)


def test_fixed_and_failing_again_is_a_regression(result):
    some = [
        result(version="1.1", time=1.0, modes=("turn",)),
        result(version="1.2", time=2.0),
        result(version="1.3", time=3.0, modes=("turn",)),
    ]
    file = file_of(turn="fixed")
    assert not failure_modes(some[:2], file)[0].is_regression
    (mode,) = failure_modes(some, file)
    assert mode.is_regression
    assert mode.comment == "about turn"


def test_regressions_come_first_then_new_ones(result):
    names = ("known", "fresh", "fixed", "accepted")
    file = file_of(known="known", fixed="fixed", accepted="accepted")
    found = failure_modes([result(modes=names)], file)
    assert [one.key.conflict_type for one in found] == ["fixed", "fresh", "known", "accepted"]


def test_what_no_block_is_about_gets_a_new_one(result):
    file = file_of(turn="known")
    found = failure_modes([result(modes=("turn", "rear\ud800"))], file)
    ((id, block),) = undecided(found, file.own).items()
    assert (block.status, block.scenario, block.driver) == ("new", "cut-in", "stack")
    assert block.title == "collides (rear\ufffd)"
    assert id == ModeKey("cut-in", "stack", "contact", "rear\ud800").id


def test_what_no_result_has_is_said(result):
    file = file_of(turn="accepted", gone="known")
    (left,) = unseen(failure_modes([result(modes=("turn",))], file), file.own).values()
    assert left.comment == "about gone"


def block(cause="planning", **more):
    return Failure(
        title="turns", scenario="mine on town", driver="stack-0.9", conflict="contact",
        type="turn", partner="car", cause=cause, files=[f"{cause}.xosc"], **more,
    )  # fmt: skip


def decided(failure, **blocks):
    """Return what a suite's blocks say of a failure."""
    folder = Path("/project")
    files = {folder / "kept": FailureFile(folder / "kept" / FILE, blocks)}
    project = Project(folder, (), (), (), (), {}, (), files)
    where, found = decisions_of({}, project).of(failure)
    return where, found.status


KEY = ModeKey("files/a.xosc", "stack", "contact", "turn", partner="car")


def test_a_scenario_of_a_file_is_the_one_that_the_suite_names():
    failure = Found(KEY, "turns", 1, searched="mine on town")
    where = "kept/failures.yaml: a"
    assert decided(failure, a=block(status="known")) == (where, "known")
    assert decided(Found(KEY, "turns", 1), a=block(status="known")) == ("", "new")
    for other in ({"driver": "else"}, {"partner": "truck"}, {"place": "at a turn"}):
        changed = Found(replace(KEY, **other), "turns", 1, searched="mine on town")
        assert decided(changed, a=block(status="known")) == ("", "new")


@pytest.mark.parametrize(
    ("statuses", "counts"),
    [
        (("accepted", "new"), "new"), (("fixed", "known"), "known"), (("fixed", "fixed"), "fixed"),
        (("accepted", "known"), "known"),
    ],
)  # fmt: skip
def test_of_blocks_that_differ_by_cause_the_one_that_calls_for_most_counts(statuses, counts):
    failure = Found(KEY, "turns", 1, searched="mine on town")
    blocks = {f"b{k}": block(f"c{k}", status=one) for k, one in enumerate(statuses)}
    assert decided(failure, **blocks)[1] == counts


def test_a_block_of_a_criterion_decides_on_its_violation_alone():
    rule = CriterionSection(id="R-1", formula="ttc >= 1 s")
    kept = block(status="known").model_copy(update={"conflict": "", "violates": [rule]})
    key = ModeKey("cut-in", "stack", requirement="R-1")
    violated = Found(key, "violates R-1", 1, searched="mine on town")
    assert decided(violated, a=kept)[1] == "known"
    assert decided(replace(violated, key=replace(key, requirement="R-2")), a=kept)[1] == "new"
    contact = block(status="known", violates=[rule])  # is about its contact
    assert decided(violated, a=contact)[1] == "new"
