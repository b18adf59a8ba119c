"""What is known of a suite's failures, by hand: which failures are excused, and which are not."""

import pytest
from tests.approval import approve
from tests.results.test_failures import failure

from bridgegen.jobs.suite.known_failures import KnownFailures, words
from bridgegen.jobs.suite.results import EntryResult, RowResult

WAY = {"conflict": "contact", "conflict_type": "front-to-rear striking", "responsible": "ego"}
KEPT = RowResult(d_min=3.0)
HIT = RowResult(critical=True, harm=0.6, **WAY)
NEAR = HIT.model_copy(update={"conflict": "near miss"})
SLOW = RowResult(margins=[-0.5, 1.0])
LOST = RowResult(problem="it diverges")
RULES = [{"id": "R-1", "formula": "ttc >= 1 s"}, {"id": "R-2", "formula": "ttc >= 2 s"}]


def stands(status, row, **more):
    one = EntryResult(
        entry="b", ego="", digest="", scenario="b.xosc", criteria=RULES, rows=[row]
    )  # fmt: skip
    return KnownFailures({"b": ("b", failure(status=status, **more))}).standing(one, row)


@pytest.mark.parametrize(
    ("status", "row", "standing"),
    [
        ("new", HIT, "new"),
        ("known", HIT, "known"),
        ("accepted", HIT, "accepted"),
        ("fixed", HIT, "regression"),
        ("known", NEAR, "new"),  # another conflict than the known one
        ("known", HIT.model_copy(update={"responsible": "shared"}), "new"),
        ("fixed", NEAR, "regression"),
        ("known", SLOW, "new"),  # a requirement that the index does not name
        ("known", HIT.model_copy(update={"margins": [1.0, -1.0]}), "new"),
        ("known", KEPT, "passed"),
        ("fixed", KEPT, "passed"),
        ("known", LOST, "not run"),
    ],
)
def test_a_variation_stands_as_its_status_says(status, row, standing):
    assert stands(status, row) == standing


def test_a_requirement_that_the_index_names_is_excused():
    more = {"violates": [RULES[0]]}
    assert stands("known", SLOW, **more) == "known"
    assert stands("known", HIT.model_copy(update={"margins": [-1.0, 1.0]}), **more) == "known"
    assert stands("known", HIT.model_copy(update={"margins": [-1.0, -1.0]}), **more) == "new"


def test_what_is_gone_and_what_is_back_is_named():
    def result(entry, ego, *rows):
        return EntryResult(
            entry=entry, ego=ego, digest="", scenario=f"{entry}.xosc", rows=list(rows)
        )  # fmt: skip

    of = {"b": ("b", failure(status="known")), "b-minimal": ("b", failure(status="known")),
          "c": ("c", failure(status="fixed")), "d": ("d", failure(status="new"))}  # fmt: skip
    known = KnownFailures(of)
    results = [
        result("b", "A", KEPT), result("b-minimal", "A", KEPT), result("c", "A", HIT),
        result("d", "A", KEPT), result("d", "B", HIT), result("e", "A", HIT),
    ]  # fmt: skip
    assert known.gone(results) == ["b"]  # with B, d is there
    assert known.regressions(results) == ["c"]
    assert known.counts(results) == {
        "passed": 3, "regression": 1, "new": 2, "not run": 0,
    }  # fmt: skip
    assert known.gone([*results, result("b-minimal", "B", HIT)]) == []
    approve(words(known.worst(results[2]), of["c"]))
    approve(words("new", of["b"]))
