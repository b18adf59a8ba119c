"""The risk of several scenarios: sums with intervals, their shares, and near misses beside them."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from tests.approval import approve, refuses
from tests.pages import without_theme

from bridgegen.base.errors import InputError, Interrupted, StorageError
from bridgegen.jobs.frame import JobCallbacks
from bridgegen.jobs.risk.estimators.total import Part, rates_of, shared_out, total_of
from bridgegen.jobs.risk.estimators.weighted import Weighted
from bridgegen.jobs.risk.extremes import of_near_misses
from bridgegen.jobs.risk.total import estimate_total_risk

pytestmark = pytest.mark.thorough

NAMES = ("crossroads-s1", "lead-brakes", "cut-in")
MET = """\
exposure_of: {name}
exposure:
  source: Made for a test.
  others: uniform
  encounters: {{count: {count}, hours: 20, {km}source: Made for a test.}}
"""


def counted(hits: int, rows: int) -> Weighted:
    weights, none = np.full(hits, 1.0 / rows), np.empty(0, np.int64)
    Z, one = np.zeros((hits, 2)), (1.0, 1.0, 1.0)
    return Weighted(Z, Z, weights, rows, none, 0, 1.0 / rows, one, rows)


def part(rate: float, hits: int, rows: int, random, count: int | None = None, n: int = 800) -> Part:
    rates = (np.full(n, rate),) * 2 if count is None else rates_of(count, 20.0, random, n)
    return Part(rate, rates, hits / rows, counted(hits, rows).draws(np.ones(hits), random, n))


def test_equal_parts_have_the_exact_interval_of_all_counts():
    """A sum of Poisson counts is one; the interval of each by itself would add up to far more."""
    random = np.random.default_rng(1)
    hits = [0, 1, 0, 2, 0, 0, 1, 3]
    found = total_of([part(1.0, one, 10**6, random, n=40_000) for one in hits])
    low, high = stats.chi2.ppf(0.025, 14) / 2e6, stats.chi2.ppf(0.975, 16) / 2e6
    assert found.estimate == pytest.approx(7e-6)
    assert found.low == pytest.approx(low, rel=0.03)
    assert found.high == pytest.approx(high, rel=0.03)
    assert sum(found.shares) == pytest.approx(1.0)


def test_intervals_of_sums_hold_the_truth():
    """Rare and common parts, encounters counted; benchmarks/risk.py total has more of it."""
    rates, p = np.array([0.2, 1.0, 4.0, 1.0]), np.array([0.05, 1e-3, 2e-4, 0.0])
    below = above = 0
    for seed in range(60):
        random = np.random.default_rng(seed)
        met = random.poisson(rates * 20.0)
        found = total_of(
            [
                part(count / 20.0, int(random.binomial(800, one)), 800, random, int(count), 300)
                for count, one in zip(met, p, strict=True)
            ]
        )
        below += found.high < rates @ p
        above += found.low > rates @ p
    assert below <= 5
    assert above <= 5


def test_the_budget_goes_where_the_sum_is_open():
    assert shared_out(1000, [3.0, 1.0, 0.0], 20) == [725, 255, 20]
    assert shared_out(90, [0.0, 0.0, 0.0], 20) == [30, 30, 30]


def test_near_misses_say_how_likely_collisions_are():
    """Margins with an exponential tail: e^(-3/0.35) of them are below 0 s."""
    random = np.random.default_rng(3)
    margins = np.clip(3.0 - random.exponential(0.35, 2000), 0.0, 4.0)
    found = of_near_misses(margins, 0)
    assert found.low <= np.exp(-3.0 / 0.35) <= found.high
    assert of_near_misses(0.4 + random.gamma(2.0, 0.8, 2000), 0).high == 0.0
    for ttc, why in (
        (np.full(2000, 4.0), "0 of 2000 encounters"),
        (np.empty(0), "0 of 0"),
        (margins * (random.random(2000) > 0.2), "have collisions"),
        (np.full(2000, 1.5), "the same shortest time"),
    ):
        assert why in of_near_misses(ttc, 0).doubt


@pytest.fixture(scope="module")
def given(tmp_path_factory):
    folder = tmp_path_factory.mktemp("met")
    for name, count, km in (("crossroads-s1", 30, "km: 900, "), ("lead-brakes", 4, "")):
        (folder / f"{name}.yaml").write_text(MET.format(name=name, count=count, km=km))
    exposures = [folder / f"{name}.yaml" for name in NAMES[:2]]
    return {
        "ego": "route-follower",
        "exposure": exposures,
        "precision": 0.0,
        "budget": 800,
        "method": "mc",
    }


@pytest.fixture(scope="module")
def total(given, tmp_path_factory):
    return estimate_total_risk(NAMES, out=tmp_path_factory.mktemp("total") / "one", **given)


def test_a_sum_is_weighted_by_how_often_each_is_met(total):
    assert total.units == ("h", "km")
    assert list(total.risks) == ["crossroads-s1", "lead-brakes"]
    assert total.left_out == {"cut-in": "no rate of encounters"}
    assert total.uniform == ("cut-in",)
    found = total.totals["collision", "h"]
    p = [total.risks[name].probability("collision").estimate for name in NAMES[:2]]
    assert found.estimate == pytest.approx(30 / 20 * p[0] + 4 / 20 * p[1])
    assert found.low < found.estimate < found.upper < found.high
    assert total.totals["collision", "km"].estimate == pytest.approx(30 / 900 * p[0])
    assert 700 <= total.spent <= 800
    assert total.risks["crossroads-s1"].budget > total.risks["lead-brakes"].budget
    assert set(total.narrowed) == {"crossroads-s1", "lead-brakes"}
    assert "further recordings" in total.advice


def test_its_record_and_page_say_it(total):
    record = json.loads((total.folder / "risk.json").read_text())
    assert record["per_hour"]["collision"]["estimate"] == total.totals["collision", "h"].estimate
    assert sum(record["per_hour"]["collision"]["shares"].values()) == pytest.approx(1.0)
    assert record["scenarios"]["lead-brakes"]["evaluations"]
    page = (total.folder / "risk.html").read_text()
    approve(total.sentence, "per hour", "per 1,000 km")
    assert total.advice in page
    assert "<script" not in without_theme(page)
    for name in total.risks:
        assert f"scenarios/{name}/risk.html" in page
        assert (total.folder / "scenarios" / name / "risk.html").is_file()


def test_stopped_and_resumed_it_is_the_same(total, given, tmp_path):
    def stop(what, done, of, facts):
        raise KeyboardInterrupt

    say = JobCallbacks(progress=stop)
    with refuses(Interrupted, "bridgegen risk crossroads-s1 lead-brakes cut-in"):
        estimate_total_risk(NAMES, out=tmp_path / "one", callbacks=say, **given)
    shutil.copytree(total.folder, tmp_path / "two")
    shutil.rmtree(tmp_path / "two/scenarios/lead-brakes")
    again = estimate_total_risk(NAMES, out=tmp_path / "two", **given)
    assert again.totals == total.totals
    with refuses(StorageError, "budget"):
        estimate_total_risk(NAMES, out=tmp_path / "two", **{**given, "budget": 1700})


def test_without_rates_each_is_met_as_often(total, tmp_path):
    none = {n: replace(r, exposure=replace(r.exposure, encounters=None)) for n, r in
            total.risks.items()}  # fmt: skip
    found = replace(total, risks=none, left_out={})
    assert found.units == ("",)
    p = [risk.probability("collision").estimate for risk in none.values()]
    assert found.totals["collision", ""].estimate == pytest.approx(sum(p) / 2.0)
    approve(found.sentence, "mean probability")


def test_what_no_simulation_says_is_not_known(total):
    """All rows of one have failed: they are no evidence of harmlessness."""
    one = total.risks["lead-brakes"]
    risks = {**total.risks, "lead-brakes": replace(one, failed=one.weighted.evaluations)}
    found = replace(total, risks=risks)
    assert found.totals["collision", "h"] is None
    assert found.totals["collision", "km"] is not None
    assert "none of" in replace(found, risks={"lead-brakes": risks["lead-brakes"]}).sentence
    (judged,) = found.judged()
    assert not judged.holds
    assert np.isnan(judged.figures["collision_per_hour_upper"])


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["lead-brakes", "cut-in", "--check", "9"], "--check"),
        (["lead-brakes", "cut-in", "--budget", "50"], "--budget"),
        (["lead-brakes", "--catalogue"], "--catalogue"),
        (["--event", "collision"], "SCENARIO"),
        (["lead-brakes", "cut-in", "--exposure", "cut-in-ann-arbor", "--exposure",
          "cut-in-ann-arbor"], "two exposures"),
        (["lead-brakes", "crossroads-s1", "--exposure", "cut-in-ann-arbor"], "none of"),
    ],
)  # fmt: skip
def test_a_mistake_is_one_line(cli, tmp_path, words, says):
    status, _, err = cli("risk", *words, "--out", tmp_path / "new")
    assert status == 2
    approve(err, says)
    assert len(err.strip().splitlines()) == 1
    assert not (tmp_path / "new").exists()


def test_one_scenario_is_no_sum(tmp_path):
    with refuses(InputError, "estimate_total_risk"):
        from bridgegen import estimate_risk

        estimate_risk(NAMES, out=tmp_path / "x")
