"""Joint distributions: their transform, conditioning and sampling; files and their errors."""

import json
from pathlib import Path

import jsonschema
import numpy as np
import pytest
import yaml
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy import integrate, stats
from tests.approval import approve, refuses

from bridgegen.base.errors import BridgeGenError, InputError, ScenarioError
from bridgegen.scenario.exposure import Encounters, example_names, exposure_of, read_exposure
from bridgegen.scenario.exposure.dependence import Copula
from bridgegen.scenario.exposure.exposure import poisson_interval
from bridgegen.scenario.language.json_schema import schema
from bridgegen.scenario.language.reader import load

pytestmark = pytest.mark.thorough

# Two parameters of a triangle: the constraint keeps half of a square.
SCENARIO = """\
scenario: triangle
title: Triangle
description: Two parameters, one at most the other.
source: Made for a test.
template: road
roads: {lanes: 2, length: 900.0, speed_limit: 36.1, road_type: motorway}
duration: 10.0
time_step: 0.05
axes: [participants]
include: [motorway, weather]
participants:
  ego:
    type: car
    start: {lane: 2, distance: 60.0}
    end: {lane: 2, distance: 200.0}
    speed: ego_speed
  bv: {type: car, start: {lane: 1, distance: bv_at}, speed: bv_speed}
parameters:
  ego_speed:
    {axis: participants, unit: m/s, low: 10, high: 20, default: 15, description: Fast., source: A}
  bv_speed:
    {axis: participants, unit: m/s, low: 10, high: 20, default: 12, description: Slow., source: A}
  bv_at:
    {axis: participants, unit: m, low: 70, high: 170, default: 100, description: Ahead., source: A}
bounds:
  - {target: bv_speed, hi: ego_speed, why: It is slower., source: Ours.}
objective: harm
"""

BLOCK = """\
source: Made for a test.
parameters:
  ego_speed: {distribution: normal, mean: 16, deviation: 3}
  bv_speed: {distribution: beta, alpha: 2, beta: 3}
  bv_at: {distribution: lognormal, median: 40 + 4*ego_speed, log_deviation: 0.3}
dependence:
  correlation:
    - {between: [ego_speed, bv_speed], value: 0.6}
    - {between: [bv_at, bv_speed], value: -0.3}
encounters: {count: 9, hours: 3.0, km: 200, source: Made for a test.}
"""


def indented(block: str) -> str:
    return "".join(f"  {line}\n" for line in block.splitlines())


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("exposure")
    (path / "triangle.yaml").write_text(SCENARIO, "utf-8")
    return path


def read(folder: Path, block: str = BLOCK, name: str = "e.yaml"):
    path = folder / name
    path.write_text(f"exposure_of: triangle\nexposure:\n{indented(block)}", "utf-8")
    return read_exposure(path)


@pytest.fixture(scope="module")
def exposure(folder):
    return read(folder)


def column(exposure, X, name):
    return X[:, exposure.space.index(name)]


def test_rows_of_a_sample_keep_the_constraints(exposure):
    sample = exposure.sample(3000, 5)
    assert exposure.space.violations(sample.X) == []
    assert exposure.feasible(sample.X).all()
    assert 0.3 < sample.share < 0.99
    share = exposure.feasible_share
    assert share.low < share.estimate < share.high
    assert list(share.rejected) == [next(iter(share.rejected))]  # the only rule that rejects
    approve(next(iter(share.rejected)), "bv_speed", "ego_speed")
    broken = 1.0 - share.estimate
    assert share.rejected[next(iter(share.rejected))] == pytest.approx(broken)


def test_a_shorter_sample_is_the_beginning_of_a_longer_one(exposure):
    long = exposure.sample(6000, 2).X
    assert np.array_equal(exposure.sample(10, 2).X, long[:10])
    assert not np.array_equal(exposure.sample(10, 3).X, long[:10])
    assert len(np.unique(long, axis=0)) == len(long)  # no block of proposals comes twice
    assert exposure.sample(0, 2).X.shape == (0, len(exposure.space.names))


@settings(deadline=None, max_examples=80)
@given(z=st.lists(st.tuples(*[st.floats(-4.0, 4.0)] * 3), min_size=1, max_size=9))
def test_the_transform_is_undone_to_1e_10(exposure, z):
    Z = np.array(z)
    assume(np.abs(exposure.copula.correlate(Z)).max() <= 4.0)
    X = exposure.from_normal(Z)
    assert np.abs(exposure.to_normal(X) - Z).max() <= 1e-10
    again = exposure.from_normal(exposure.to_normal(X))
    assert np.allclose(again, X, rtol=1e-12, atol=0.0)


@settings(deadline=None, max_examples=40)
@given(
    z=st.lists(st.tuples(*[st.floats(-4.0, 4.0)] * 3), min_size=1, max_size=9),
    freedom=st.floats(2.0, 1000.0),
    order=st.permutations(range(3)),
)
def test_student_s_copula_is_undone_and_has_student_s_density(z, freedom, order):
    """By SciPy's multivariate distribution; the third parameter is independent of both."""
    names = tuple("abc"[k] for k in order)
    rows = np.array([[1, -0.5, 0], [-0.5, 1, 0], [0, 0, 1]])[np.ix_(order, order)]
    copula = Copula(names, tuple(map(tuple, rows.tolist())), freedom, ("b", "a"))
    Z = np.array(z)
    Y = copula.correlate(Z)
    assume(np.abs(Y).max() <= 6.0)
    assert np.abs(copula.whiten(Y) - Z).max() <= 1e-6
    one = stats.t(freedom)
    both = np.where(Y > 0.0, one.isf(stats.norm.sf(Y)), one.ppf(stats.norm.cdf(Y)))
    both = both[:, [names.index("a"), names.index("b")]]
    known = stats.multivariate_t(shape=[[1, -0.5], [-0.5, 1]], df=freedom).logpdf(both)
    assert np.allclose(copula.log_density(Y), known - one.logpdf(both).sum(1), atol=1e-6)


def test_student_s_copula_has_tails_of_its_own(folder):
    """Both in their upper hundredth: λ of 4 degrees of freedom and 0.6 is 0.35 in the limit."""
    shares = []
    for freedom in ("", "  degrees_of_freedom: 4\n"):
        found = read(folder, BLOCK.replace("encounters", f"{freedom}encounters"), "tails.yaml")
        Z = np.random.default_rng(2).standard_normal((15_000, 3))
        Y = found.copula.correlate(Z)[:, :2]
        assert stats.kstest(Y[:, 1], "norm").pvalue > 1e-3
        shares.append(float(np.mean(Y[Y[:, 0] > 2.33, 1] > 2.33)))
    assert shares[1] > 1.5 * shares[0]
    assert 0.28 < shares[1] < 0.55


def test_rows_have_the_same_bits_in_any_batch(exposure):
    Z = np.random.default_rng(1).standard_normal((333, 3))
    X = exposure.from_normal(Z)
    whole, back = exposure.log_density(X), exposure.to_normal(X)
    for part in (slice(0, 1), slice(7, 24), slice(300, 333)):
        assert np.array_equal(exposure.from_normal(Z[part]), X[part])
        assert np.array_equal(exposure.log_density(X[part]), whole[part])
        assert np.array_equal(exposure.to_normal(X[part]), back[part])


def test_the_unconditioned_distribution_is_the_one_declared(exposure):
    """Marginals by Kolmogorov's test; the copula's Kendall's τ is 2/π asin ρ (Nelsen, 5.1.2)."""
    Z = np.random.default_rng(8).standard_normal((20_000, 3))
    X = exposure.from_normal(Z)
    ego, bv = column(exposure, X, "ego_speed"), column(exposure, X, "bv_speed")
    cut = stats.truncnorm(-2.0, 4.0 / 3.0, 16.0, 3.0)
    assert stats.kstest(ego, cut.cdf).pvalue > 1e-3
    assert stats.kstest(bv, stats.beta(2.0, 3.0, 10.0, 10.0).cdf).pvalue > 1e-3
    tau = stats.kendalltau(ego[:4000], bv[:4000]).statistic
    assert tau == pytest.approx(2.0 / np.pi * np.arcsin(0.6), abs=0.03)
    # bv_at divided by its median is the same log-normal at any speed, but for the cut.
    at = column(exposure, X, "bv_at")
    middle = (ego > 14.0) & (ego < 16.0)
    assert np.median(at[middle] / (40 + 4 * ego[middle])) == pytest.approx(1.0, abs=0.03)


def test_the_density_is_normalised_over_the_feasible_set(folder):
    flat = read(folder, "source: s\nparameters:\n  ego_speed: {distribution: uniform}\n"
                "  bv_speed: {distribution: uniform}\nothers: default\n", "flat.yaml")  # fmt: skip
    X = flat.sample(5, 0).X
    # Half of the square of 10 by 10, and the tolerance of the constraint: 2/100.
    assert flat.feasible_share.estimate == pytest.approx(0.5, abs=0.006)
    density = np.exp(flat.log_density(X))
    assert np.allclose(density, 0.01 / flat.feasible_share.estimate, rtol=1e-12)
    ego, bv = (flat.space.index(name) for name in ("ego_speed", "bv_speed"))
    X[0, bv] = X[0, ego] + 1.0
    assert np.isneginf(flat.log_density(X)[0])


def test_conditioning_leaves_relative_densities(exposure):
    X = exposure.sample(50, 4).X
    ego, bv, at = (column(exposure, X, name) for name in ("ego_speed", "bv_speed", "bv_at"))
    cut = stats.truncnorm(-2.0, 4.0 / 3.0, 16.0, 3.0)
    slow = stats.beta(2.0, 3.0, 10.0, 10.0)
    ahead = stats.lognorm(0.3, scale=40.0 + 4.0 * ego)
    mass = ahead.cdf(170.0) - ahead.cdf(70.0)
    shares = [cut.cdf(ego), slow.cdf(bv), (ahead.cdf(at) - ahead.cdf(70.0)) / mass]
    scores = stats.norm.ppf(shares).T
    matrix = np.array([[1, 0.6, 0], [0.6, 1, -0.3], [0, -0.3, 1]])
    copula = stats.multivariate_normal(cov=matrix).logpdf(scores) - stats.norm.logpdf(scores).sum(1)
    expected = cut.logpdf(ego) + slow.logpdf(bv) + ahead.logpdf(at) - np.log(mass) + copula
    offset = exposure.log_density(X) - expected
    assert np.allclose(offset, -np.log(exposure.feasible_share.estimate), atol=1e-9)


def test_the_feasible_share_is_an_integral(folder):
    two = read(folder, "source: s\nparameters:\n  ego_speed: {distribution: normal, mean: 16, "
               "deviation: 3}\n  bv_speed: {distribution: beta, alpha: 2, beta: 3}\n"
               "others: default\n", "two.yaml")  # fmt: skip
    cut = stats.truncnorm(-2.0, 4.0 / 3.0, 16.0, 3.0)
    slow = stats.beta(2.0, 3.0, 10.0, 10.0)
    slack = lambda speed: 1e-4 * (1.0 + speed)  # noqa: E731
    exact, _ = integrate.quad(lambda v: cut.pdf(v) * slow.cdf(v + slack(v)), 10.0, 20.0)
    share = two.feasible_share
    assert share.low <= exact <= share.high


def test_a_block_in_the_scenario_is_the_same_exposure(folder, exposure):
    (folder / "with.yaml").write_text(SCENARIO + "exposure:\n" + indented(BLOCK), "utf-8")
    scenario = load(folder / "with.yaml")
    own = exposure_of(scenario)
    assert np.array_equal(own.sample(20, 1).X, exposure.sample(20, 1).X)
    plain = load(folder / "triangle.yaml")
    assert exposure_of(plain) is None
    assert scenario.fingerprint == plain.fingerprint  # no search depends on it
    assert scenario == plain


def test_a_correlation_of_a_row_with_defaults(folder):
    """Parameters without a marginal stand at their default, moved where a bound asks for it."""
    one = read(folder, "source: s\nothers: default\nparameters:\n"
               "  ego_speed: {distribution: uniform, high: 13}\n", "one.yaml")  # fmt: skip
    X = one.sample(500, 0).X
    ego, bv = column(one, X, "ego_speed"), column(one, X, "bv_speed")
    assert np.array_equal(bv, np.minimum(ego, 12.0))
    assert one.feasible_share.estimate == 1.0


def one_of(name: str, form: str) -> str:
    return f"others: default\nparameters:\n  {name}: {form}"


WRONG = [
    (one_of("ego_spede", "{distribution: uniform}"), "unknown parameter 'ego_spede'; did", 6),
    (one_of("ego_speed", "{distribution: uniform, lowest: 3}"), "unknown key 'lowest'", 6),
    (one_of("ego_speed", "{distribution: gauss}"), "must be 'uniform', 'normal'", 6),
    (one_of("ego_speed", "{distribution: uniform, low: 3}"), "low must be in the range", 6),
    ("parameters:\n  ego_speed: {distribution: uniform}", "others must say", 2),
    (one_of("ego_speed", "{distribution: uniform, source: ''}"), "must not be empty", 6),
    (
        "others: uniform\ndependence:\n  correlation:\n    - {between: [ego_speed, bv], value: 0}",
        "must be between distributed parameters, got 'bv'", 7,
    ),
    (
        "others: uniform\ndependence:\n  correlation:\n"
        "    - {between: [ego_speed, bv_speed], value: 1}", "above -1 and below 1, got 1", 7,
    ),
    (
        "others: uniform\ndependence:\n  correlation:\n"
        "    - {between: [ego_speed, bv_speed], value: 0.9}\n"
        "    - {between: [ego_speed, bv_at], value: 0.9}\n"
        "    - {between: [bv_at, bv_speed], value: -0.9}", "must be positive definite", 5,
    ),
    (
        "others: uniform\ndependence: {degrees_of_freedom: 4}",
        "must be 2 to 1000, and stand with a correlation", 5,
    ),
    (
        "others: uniform\nencounters: {count: -1, hours: 3, source: s}",
        "count must be 0 to 1e+12, got -1", 5,
    ),
    ("others: uniform\nencounters: {count: 1, km: 0, source: s}", "km [km] must be above 0", 5),
    ("others: uniform\nencounters: {count: 1, source: s}", "hours [h] or km [km] in which", 5),
    (
        "others: uniform\nparameters:\n  ego_speed: {distribution: normal, mean: bv_speed, "
        "deviation: 1}\n  bv_speed: {distribution: normal, mean: ego_speed, deviation: 1}",
        "in a circle, got", 2,
    ),
    (
        "others: default\nparameters:\n  ego_speed: {distribution: normal, mean: 15, deviation: 1}"
        "\n  bv_speed: {distribution: normal, mean: 15, deviation: 12 - bv_at}",
        "deviation must be above 0", None,
    ),
    (
        "others: default\nparameters:\n  ego_speed: {distribution: uniform, high: 11}\n"
        "  bv_speed: {distribution: uniform, low: 12}", "break 'bv_speed <= ego_speed", None,
    ),
]  # fmt: skip


@pytest.mark.parametrize(("rest", "rule", "line"), WRONG)
def test_a_mistake_is_one_clear_error_with_its_line(folder, rest, rule, line):
    with pytest.raises(InputError) as error:
        read(folder, f"source: s\n{rest}\n", "wrong.yaml")
    assert len(error.value.problems) == 1
    assert rule in str(error.value)
    if line:
        approve(str(error.value), "wrong.yaml", line)


def test_a_source_is_required(folder):
    with refuses(ScenarioError, "source"):
        read(folder, "others: uniform\n", "none.yaml")


def test_an_exposure_of_another_scenario_is_refused(folder, exposure):
    with refuses(ScenarioError, "cut-in"):
        read_exposure(folder / "e.yaml", load("cut-in"))
    (folder / "lost.yaml").write_text("exposure_of: lost\nexposure: {source: s}\n", "utf-8")
    with refuses(ScenarioError):
        read_exposure(folder / "lost.yaml")


def test_a_kernel_density_reads_its_table(folder):
    rows = "\n".join(f"{x},a" for x in np.linspace(70.5, 120.0, 60))
    (folder / "seen.csv").write_text(f"at,other\n{rows}\n", "utf-8")
    block = ("source: s\nothers: default\nparameters:\n  bv_at: {distribution: kde, "
             "file: seen.csv, column: at, bandwidth: 300 cm}\n")  # fmt: skip
    at = column(one := read(folder, block, "kde.yaml"), one.sample(4000, 1).X, "bv_at")
    assert stats.kstest(at, stats.uniform(69.0, 52.0).cdf).statistic < 0.06
    (folder / "seen.csv").write_text("at,other\n71,a\nfast,b\n", "utf-8")
    with refuses(BridgeGenError, "fast", "line 3"):
        read(folder, block, "kde.yaml")


@pytest.mark.parametrize("name", example_names())
def test_examples_are_read_and_say_that_they_are_examples(name):
    one = read_exposure(name)
    assert one.source.startswith("Example.")
    assert len(one.sample(10, 0).X) == 10


def test_the_schema_takes_what_the_reader_takes(folder, exposure):
    made = schema("exposure")
    json.dumps(made)
    check = jsonschema.Draft7Validator(made)
    check.validate(yaml.safe_load((folder / "e.yaml").read_text("utf-8")))
    bad = {"exposure_of": "triangle", "exposure": {"source": "s", "oters": "uniform"}}
    assert list(check.iter_errors(bad))
    whole = yaml.safe_load(SCENARIO + "exposure:\n" + indented(BLOCK))
    jsonschema.Draft7Validator(schema()).validate(whole)


@pytest.mark.parametrize("mean", [0.4, 1.3, 5.0, 12.5, 60.0])
def test_the_interval_of_a_count_covers_its_mean(mean):
    """Exactly, by summing the Poisson probabilities of the counts whose interval holds the mean."""
    counts = np.arange(int(mean + 12.0 * np.sqrt(mean) + 30.0))
    held = [low <= mean <= high for low, high in map(poisson_interval, counts.tolist())]
    covered = stats.poisson(mean).pmf(counts)[held].sum()
    assert 0.95 <= covered < 0.995
    assert poisson_interval(0)[1] == pytest.approx(-np.log(0.025))


def test_rates_are_counts_over_driving():
    rate = Encounters(9, 3.0, 200.0, "s").per_hour
    assert (rate.estimate, rate.low) == (3.0, poisson_interval(9)[0] / 3.0)
    assert Encounters(9, None, 200.0, "s").per_hour is None
