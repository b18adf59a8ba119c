from dataclasses import replace

import numpy as np
import pytest
from tests.approval import approve

from bridgegen.pages import sentences
from bridgegen.pages.data import ReportData

THIN = "\N{NARROW NO-BREAK SPACE}"


def of(data: ReportData) -> list[str]:
    return [sentence.replace(THIN, " ") for sentence in sentences.sentences(data)]


def test_three_sentences(with_summary):
    data = with_summary(
        n_evaluations=1000, n_critical=312, r_critic=0.312, first_critical=14, fiftieth_critical=120
    )
    first, second, third = of(data)
    approve(first, "1,000", "route-follower", "3.4 s")
    approve(second, "312", "31.2 %", "14", "120")
    e = data.evaluations
    values = {c.name: c.values for c in e.metrics}
    hits = values["n_collision"] > 0
    top = values["v_d"][hits].max()
    approve(third, hits.sum(), f"{top:.1f} m/s", f"{3.6 * top:.0f} km/h")


def test_without_a_collision_the_closest_pass_counts(report):
    e = report.evaluations
    metrics = tuple(
        replace(c, values=np.zeros(120)) if c.name == "n_collision" else c for c in e.metrics
    )
    data = replace(
        report,
        evaluations=replace(e, metrics=metrics),
        summary=replace(report.summary, d_min_best=0.4321),
    )
    approve(of(data)[-1], "0.43 m")


def test_failed_evaluations_are_no_collisions(report):
    failed = replace(report.evaluations, status=np.ones(120, np.int64))
    approve(of(replace(report, evaluations=failed))[-1], "collision")


def test_nothing_critical(with_summary):
    data = with_summary(n_critical=0, first_critical=None, fiftieth_critical=None, r_critic=0.0)
    assert of(data)[1:] == [
        "None of them is critical (critical means a collision, or d_min below 2 m while v_d is at "
        "least 1 m/s)."
    ]


def test_stopped_early(with_summary):
    data = with_summary(finished=False, budget=5000)
    approve(of(data)[0], "5,000")
    assert ("Done", "120 evaluations, interrupted") in sentences.provenance(data.summary)


def test_nothing_done(build):
    assert of(build(0, 0)) == [
        "No scenario of “Left turn into the path of a crossing car” has been simulated yet."
    ]


def test_one_is_singular(with_summary):
    data = with_summary(n_evaluations=1, budget=1, n_critical=0)
    approve(of(data)[0], "concrete", "simulated")
    approve(of(data)[1], "critical")
    assert ("Budget", "1 evaluation") in sentences.provenance(data.summary)


def test_the_table_shows_a_dash_for_what_does_not_exist(with_summary):
    nan = float("nan")
    data = with_summary(
        r_critic=nan, d_min_best=nan, d_min_median=nan, v_d_best=nan, v_d_median=float("inf"),
        first_critical=None, fiftieth_critical=None, n_critical=0, n_evaluations=0,
        wall_seconds=nan,
    )  # fmt: skip
    table = dict(sentences.summary_table(data))
    assert table["Critical"] == "0 (–)"
    assert table["First critical"] == table["50th critical"] == "not reached"
    assert {value for name, value in table.items() if "d_min" in name or "v_d" in name} == {"–"}
    assert table["Simulated"] == "0 in –"


def test_settings_follow_in_the_order_given(with_summary):
    data = with_summary(settings={"inertia": "0.8", "c1": "1.5"}, started="")
    rows = sentences.provenance(data.summary)
    assert rows[-2:] == [("inertia", "0.8"), ("c1", "1.5")]
    assert "Started" not in dict(rows)


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.04, "0.0 s"), (119.94, "119.9 s"), (125.0, "2 min 5 s"), (7261.0, "2 h 1 min")],
)
def test_a_duration_takes_the_unit_that_suits_it(seconds, text):
    assert sentences.duration(seconds).replace(THIN, " ") == text


def test_only_the_share_of_independent_draws_has_an_interval(with_summary):
    told = {"n_evaluations": 100, "n_critical": 10, "r_critic": 0.1}
    chosen, drawn = with_summary(**told), with_summary(**told, independent=True, algorithm="random")
    name = "95 % interval of the critical share"
    table = {k: v.replace(THIN, " ") for k, v in sentences.summary_table(drawn)}
    assert table[name] == "5.5 to 17.4 %"  # worked by hand
    assert name not in dict(sentences.summary_table(chosen))
    empty = with_summary(n_evaluations=0, n_critical=0, independent=True)
    assert dict(sentences.summary_table(empty))[name] == "–"
