"""Failure modes over all results, with the status that a person sets."""

from bridgegen.jobs.dashboard.modes import decisions_of, failure_modes, unseen
from bridgegen.jobs.dashboard.results import ModeKey
from bridgegen.jobs.dashboard.status_file import Decision, StatusFile


def file_of(**statuses):
    """Return a status file, by conflict type of cut-in, stack."""
    found = {}
    for kind, status in statuses.items():
        name = ModeKey("cut-in", "stack", "contact", kind).id
        found[name] = Decision(name, status, note=f"about {kind}")
    return StatusFile("", {}, found)


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
    assert mode.note == "about turn"


def test_regressions_come_first_then_new_ones(result):
    names = ("known", "fresh", "fixed", "accepted")
    file = file_of(known="known", fixed="fixed", accepted="accepted")
    found = failure_modes([result(modes=names)], file)
    assert [one.key.conflict_type for one in found] == ["fixed", "fresh", "known", "accepted"]


def test_blocks_for_the_file_keep_the_status(result):
    found = failure_modes([result(modes=("turn",))], file_of(turn="known"))
    (block,) = decisions_of(found)
    assert (block.id, block.status, block.scenario) == (found[0].key.id, "known", "cut-in")


def test_what_no_result_has_is_said(result):
    file = file_of(turn="accepted", gone="known")
    (left,) = unseen(failure_modes([result(modes=("turn",))], file), file)
    assert left.note == "about gone"
