"""Results over time."""

import re
from xml.etree import ElementTree

from hypothesis import given
from hypothesis import strategies as st

from bridgegen.jobs.dashboard.page import chart
from bridgegen.jobs.dashboard.results_of import SuiteLine
from bridgegen.jobs.dashboard.trends import MOST_POINTS, Point, Series, trends
from bridgegen.pages.charts import strip
from bridgegen.search.triage.record import Estimate


def estimate(harmful: int, rows: int) -> Estimate:
    share = harmful / rows
    return Estimate(
        drawn="fresh",
        rows=rows,
        harmful=harmful,
        share=share,
        low=share / 2,
        high=min(1, 2 * share),
    )


def test_runs_of_a_scenario_are_in_the_order_of_time(result):
    runs = [
        result(version="1.10", time=2.0, space=estimate(8, 100)),
        result(version="1.9", time=1.0, space=estimate(2, 100)),
    ]
    (found,) = trends(runs, [])
    assert [point.version for point in found.points] == ["1.9", "1.10"]
    assert [point.share for point in found.points] == [0.02, 0.08]
    assert abs(found.change - 0.06) < 1e-12


def test_a_run_without_a_known_share_is_no_point(result):
    assert trends([result()], []) == []


def test_suites_with_the_same_entries_are_one_over_time(result):
    def suite(source, time, failed, entries=("a", "b")):
        results = tuple(
            result(one, time=time, kind="suite", entry=one, failed=failed) for one in entries
        )
        return SuiteLine(source, "", time, ("stack-1.0",), results, None, ())

    found = trends([], [suite("new", 2.0, 5), suite("old", 1.0, 1), suite("else", 3.0, 0, ("a",))])
    shares = {one.title: [point.share for point in one.points] for one in found}
    assert shares == {"new (2 scenarios)": [0.1, 0.5], "else (1 scenario)": [0.0]}


def test_what_grew_is_first_and_old_points_are_left_out(result):
    runs = [result("a", time=float(k), space=estimate(1, 10)) for k in range(MOST_POINTS + 5)]
    runs += [result("b", time=float(k), space=estimate(k, 10)) for k in range(2)]
    found = trends(runs, [])
    assert [one.title for one in found] == ["b", "a"]
    assert (len(found[1].points), found[1].left_out) == (MOST_POINTS, 5)


shares = st.floats(0.0, 1.0)
points = st.builds(
    Point, driver=st.text(max_size=30), version=st.text(max_size=30), source=st.text(max_size=9),
    page=st.just(""), time=st.floats(-1e12, 1e12), count=st.integers(0, 9), of=st.just(9),
    share=shares, low=shares, high=shares,
)  # fmt: skip


@given(st.lists(points, min_size=1, max_size=MOST_POINTS), st.text(max_size=20))
def test_a_chart_is_well_formed_and_stays_in_its_box(some, title):
    text = chart(Series(title, "d", "harmful share", tuple(some)), ".")
    legal = re.sub("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd]", "", text)
    for one in ElementTree.fromstring(legal).iter("circle"):
        assert 0.0 <= float(one.get("cx")) <= 340.0
        assert 0.0 <= float(one.get("cy")) <= 150.0


def test_an_empty_bin_is_outlined_only():
    text = strip([0, 4, 2])
    assert text.count('class="none"') == 1
    assert 'fill-opacity="1.00"' in text
