"""Which results say how things stand."""

from itertools import permutations

from bridgegen.jobs.dashboard.results import ModeKey, Seen, current, versions


def test_the_version_that_was_tested_last_counts_with_all_its_results(result):
    old = result(version="1.1", time=1.0)
    one = result(version="1.2", time=2.0, source="a")
    two = result(version="1.2", time=3.0, source="b")
    assert current([two, old, one]) == [one, two]


def test_of_an_unknown_version_only_the_latest_result_counts(result):
    one, two = result(version="", time=1.0), result(version="", time=2.0)
    assert current([one, two]) == [two]


def test_scenarios_are_judged_by_themselves(result):
    old = result("cut-out", version="1.1", time=1.0)
    new = result("cut-in", version="1.2", time=2.0)
    assert current([old, new]) == [old, new]


def test_the_order_of_results_does_not_matter(result):
    some = [result(version=str(k % 2 + 1), time=float(k), source=str(k)) for k in range(4)]
    assert len({tuple(current(order)) for order in permutations(some)}) == 1


def test_versions_are_in_the_order_of_first_appearance(result):
    some = [result(version=v, time=t) for v, t in (("1.10", 2.0), ("1.9", 1.0), ("1.10", 3.0))]
    assert [one.version for one in versions(some)["stack"]] == ["1.9", "1.10"]


def test_an_id_is_no_number_in_yaml():
    import yaml

    for k in range(300):  # 1234e567891 would be infinite
        assert isinstance(yaml.safe_load(ModeKey(str(k), "stack").id), str)


def test_each_part_of_a_key_makes_another_id():
    one = ModeKey("a", "b")
    others = [ModeKey("ab", ""), ModeKey("a", "b", "contact"), ModeKey("a", "b", "", "contact")]
    assert len({key.id for key in (one, *others)}) == 4


def test_a_run_that_has_not_finished_clears_nothing(result):
    old = result(version="1.1", time=1.0, modes=("turn",))
    new = result(version="1.2", time=2.0, finished=False)
    assert current([old, new]) == [old]
    assert current([new]) == [new]
    later = result(version="1.2", time=3.0, source="b")
    assert current([old, new, later]) == [new, later]


def test_bins_of_two_scenarios_with_one_name_are_not_mixed():
    one, two = Seen(1, bins={"a": [1, 0]}), Seen(1, bins={"a": [0, 0, 1], "b": [1]})
    one.add(two)
    assert (one.evaluations, one.bins) == (2, {"a": [1, 0], "b": [1]})


def test_a_search_for_where_it_is_worse_clears_nothing(result):
    old = result(version="", time=1.0, modes=("turning",))
    worse = result(version="", time=2.0, kind="difference", worse_than="stack-0.9")
    assert current([old, worse]) == [old, worse]
