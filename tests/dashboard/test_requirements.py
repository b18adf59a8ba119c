"""Requirements by scenario and driver."""

from bridgegen.jobs.dashboard.requirements import matrices, statements
from bridgegen.scenario.language.criteria import Criterion

DECLARED = Criterion("R-99", "min(ego.v) > 0", severity="critical")


def test_a_requirement_is_met_violated_or_not_tested(result):
    some = [
        result("cut-in", judged=(("R-1", 8, 2), ("R-2", 10, 0)), page="a.html"),
        result("cut-out", judged=(("R-2", 10, 0),)),
        result("lead-brakes"),
    ]
    (found,) = matrices(some, [DECLARED])
    assert found.cell("cut-in", "R-1").verdict == "violated"
    assert found.cell("cut-in", "R-1").page == "a.html"
    assert found.cell("cut-out", "R-2").verdict == "met"
    assert found.cell("cut-out", "R-1") is None
    assert found.without == ["lead-brakes"]
    assert found.untested == ["R-99"]
    assert [one.id for one in found.requirements] == ["R-99", "R-1", "R-2"]  # the gravest first


def test_results_of_one_scenario_are_counted_together_and_the_worst_is_linked(result):
    some = [
        result(judged=(("R-1", 10, 0),), source="a", page="a.html", time=1.0),
        result(judged=(("R-1", 7, 3),), source="b", page="b.html", time=2.0),
        result(judged=(("R-1", 10, 0),), source="c", page="c.html", time=3.0),
    ]
    (found,) = matrices(some)
    cell = found.cell("cut-in", "R-1")
    assert (cell.met, cell.violated, cell.worst, cell.page) == (27, 3, -1.0, "b.html")


def test_an_earlier_version_does_not_count(result):
    some = [
        result(version="1.1", time=1.0, judged=(("R-1", 0, 10),)),
        result(version="1.2", time=2.0, judged=(("R-1", 10, 0),)),
    ]
    (found,) = matrices(some)
    assert found.cell("cut-in", "R-1").verdict == "met"
    assert found.labels == ("stack-1.2",)


def test_each_driver_has_a_matrix(result):
    some = [result(judged=(("R-1", 1, 0),)), result(name="other", judged=(("R-1", 0, 1),))]
    found = matrices(some)
    assert [one.driver for one in found] == ["other", "stack"]
    assert [one.violated("R-1") for one in found] == [["cut-in"], []]


def test_an_id_with_two_formulas_is_found(result):
    some = [result(judged=(("R-1", 1, 0),))]
    assert statements(some) == {"R-1": ["min(ego.v) > 0"]}
