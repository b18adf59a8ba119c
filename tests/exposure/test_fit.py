"""Fits of planted events, and the files and errors of ``bridgegen fit``."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from tests.approval import approve, refuses
from tests.pages import without_theme

from bridgegen.base.errors import BridgeGenError, InputError
from bridgegen.base.units import percent
from bridgegen.cli import main
from bridgegen.openx.openscenario.distributions import distribution_of, read_distribution
from bridgegen.scenario.exposure import read_exposure
from bridgegen.scenario.exposure.candidates import candidates
from bridgegen.scenario.exposure.fit import LEAST_ROWS, fit_exposure
from bridgegen.scenario.language.reader import load

PLANTED = """\
exposure_of: cut-in
exposure:
  source: Made for a test.
  others: default
  parameters:
    ego_speed: {distribution: normal, mean: 26, deviation: 4}
    speed_difference: {distribution: gamma, shape: 3, scale: 1.2}
    gap: {distribution: lognormal, median: 45, log_deviation: 0.35}
  dependence:
    correlation:
      - {between: [ego_speed, gap], value: 0.6}
      - {between: [ego_speed, speed_difference], value: -0.3}
"""
NAMES = ("ego_speed", "speed_difference", "gap")


@pytest.fixture(scope="module")
def scenario():
    return load("cut-in")


@pytest.fixture(scope="module")
def planted(tmp_path_factory, scenario):
    path = tmp_path_factory.mktemp("planted") / "planted.yaml"
    path.write_text(PLANTED, "utf-8")
    return read_exposure(path, scenario)


@pytest.fixture(scope="module")
def events(planted):
    X = planted.from_normal(np.random.default_rng(4).standard_normal((400, 3)))
    return {name: X[:, planted.space.index(name)] for name in NAMES}


@pytest.fixture(scope="module")
def fit(scenario, events):
    return fit_exposure(
        scenario, events, hours=50.0, km=4000.0, others="default", replicates=20, seed=3
    )


def test_a_fit_sees_that_parameters_are_extreme_together(scenario, planted):
    copula = replace(planted.copula, freedom=3.0, tied=NAMES)
    random = np.random.default_rng(5)
    road = replace(planted, copula=copula)
    X = road.from_normal(random.standard_normal((300, 3)))
    found = fit_exposure(
        scenario,
        {name: X[:, planted.space.index(name)] for name in NAMES[:2]},
        others="default",
        replicates=20,
    )
    assert 2.0 <= found.freedom <= 5.0
    assert found.exposure.copula.freedom == found.freedom
    assert {item.copula.freedom for item in found.replicates} == {found.freedom}
    assert found.exposure.copula.tied == NAMES[:2]
    assert any("Student's copula with" in note for note in found.notes)


def test_a_fit_finds_what_was_planted(fit, planted):
    """Within what 400 events tell: 0.068 is the band of their distribution function (95 %)."""
    for name, one in fit.parameters.items():
        truth = planted.marginals[name]
        x = np.linspace(truth.low, truth.high, 301)
        assert np.abs(one.marginal.tails(x)[0] - truth.tails(x)[0]).max() < 0.05
    i, j, k = (fit.correlated.index(name) for name in NAMES)
    assert fit.freedom is None
    assert fit.correlation[i, k] == pytest.approx(0.6, abs=0.12)
    assert fit.correlation[i, j] == pytest.approx(-0.3, abs=0.12)
    low, high = fit.correlation_band
    assert low[i, k] < 0.6 < high[i, k]
    for one in fit.parameters.values():
        assert one.p > 0.01
        assert np.all(one.band[0] <= one.band[1] + 1e-15)


def test_the_encounters_are_the_feasible_events(fit, events):
    encounters = fit.exposure.encounters
    assert encounters.count == len(events["gap"]) - sum(fit.infeasible.values())
    assert encounters.per_hour.estimate == encounters.count / 50.0


def test_the_file_is_the_exposure(fit, scenario, tmp_path):
    path = tmp_path / "fitted.yaml"
    path.write_text(fit.text, "utf-8")
    again = read_exposure(path, scenario)
    assert np.array_equal(again.sample(50, 1).X, fit.exposure.sample(50, 1).X)
    approve(again.source, "BridgeGen")


def test_the_same_seed_gives_the_same_bits(scenario, events):
    few = {name: events[name][:60] for name in ("ego_speed", "gap")}
    one, same, other = (
        fit_exposure(scenario, few, others="default", replicates=20, seed=seed)
        for seed in (3, 3, 4)
    )
    assert same.text == one.text
    for name, each in one.parameters.items():
        assert same.parameters[name].p == each.p
        assert np.array_equal(same.parameters[name].band, each.band)
        assert not np.array_equal(other.parameters[name].band, each.band)


def test_replicates_are_exposures_that_differ_as_the_data_allow(fit):
    assert len(fit.replicates) == 20
    half, above = np.array([0.5]), np.array([False])
    middles = [float(one.marginals["ego_speed"].value(half, above)[0]) for one in fit.replicates]
    assert 0.05 < np.std(middles) < 0.6  # of a median, 1.25 σ/√n = 0.25 at most
    assert fit.replicates[0].sample(5, 0).X.shape == fit.exposure.sample(5, 0).X.shape


def test_a_wrong_form_has_a_small_p():
    """Two humps are no uniform distribution: the kernels win, and a normal would be far off."""
    random = np.random.default_rng(2)
    values = np.concatenate([random.normal(20.0, 1.5, 300), random.normal(60.0, 2.0, 300)])
    best, *rest = candidates(values, 10.0, 80.0)
    assert best.recipe.body == "kde"
    assert rest[0].criterion > best.criterion
    normal = next(one for one in rest if one.recipe.text == "normal")
    assert normal.criterion > best.criterion + 500.0


def test_a_heavy_tail_is_found_where_there_are_exceedances():
    random = np.random.default_rng(6)
    body = stats.truncnorm(-3.0, 1.5, 20.0, 4.0).rvs(1800, random_state=random)
    tail = 26.0 + stats.genpareto(0.4, scale=8.0).rvs(200, random_state=random)
    values = np.concatenate([body, tail])
    best = candidates(values[values < 300.0], 0.0, 300.0)[0]
    assert best.recipe.upper is not None
    assert best.section["upper_tail"]["shape"] == pytest.approx(0.4, abs=0.25)
    few = candidates(values[::10][values[::10] < 300.0], 0.0, 300.0)  # 20 exceedances
    assert all(one.recipe.upper is None for one in few)


def test_too_few_rows_say_how_many_are_needed(scenario, events):
    few = {name: values[: LEAST_ROWS - 1] for name, values in events.items()}
    with refuses(InputError, "47", "46"):
        fit_exposure(scenario, few, others="default")


@pytest.mark.parametrize("count", [1, 9, 47])
def test_few_events_are_weighed_with_a_prior(scenario, planted, events, count):
    few = {name: values[:count] for name, values in events.items()}
    made = fit_exposure(
        scenario, few, others="default", hours=2.0, prior=planted, replicates=20, seed=1
    )
    share = count / (count + 47)
    for name in NAMES:
        marginal, before = made.exposure.marginals[name], planted.marginals[name]
        edges = np.array(made.parameters[name].section["edges"])
        seen = (few[name][:, np.newaxis] < edges).mean(axis=0)
        seen[-1] = 1.0
        wanted = share * seen + (1.0 - share) * before.tails(edges)[0]
        assert marginal.tails(edges)[0] == pytest.approx(wanted, abs=1e-5)
    told = f"{count} events count {percent(share)}, and {percent(1.0 - share)} is the prior"
    assert told in made.exposure.source
    assert told in made.exposure.weighed
    assert f"{percent(1.0 - share)} of it is the prior" in [*made.facts()]
    assert any(told in remark for remark in made.remarks())
    assert made.exposure.encounters.per_hour.estimate == pytest.approx(
        made.exposure.encounters.count / 2.0
    )
    names = made.exposure.names
    i, j = names.index("ego_speed"), names.index("gap")
    scores = made.exposure.copula.matrix[i, j]
    if count == 1:  # no correlation is seen
        assert scores == pytest.approx((1.0 - share) * 0.6, abs=1e-4)


def test_values_outside_are_counted_with_a_range_that_holds_them(scenario, events):
    gap = events["gap"][:100].copy()
    gap[:2] = 95.5, 3.0
    some = {"ego_speed": events["ego_speed"][:100], "gap": gap}
    fit = fit_exposure(scenario, some, others="default", replicates=20, km=10.0)
    assert (fit.rows, fit.used) == (100, 98)
    assert fit.outside == (
        "gap [m]: 2 of 100 values are outside 10 to 80; low: 3, high: 95.5 would hold them",
    )
    assert fit.exposure.encounters.count == 98 - sum(fit.infeasible.values())


@pytest.mark.parametrize(
    ("change", "rule"),
    [
        ({"speed": 1.0}, "speed"),
        ({"gap": 30.0}, "30"),
    ],
)
def test_a_column_that_cannot_be_fitted_is_refused(scenario, events, change, rule):
    few = {name: values[:60] for name, values in events.items()}
    few |= {name: np.full(60, value) for name, value in change.items()}
    with refuses(InputError, rule):
        fit_exposure(scenario, few, others="default")


def test_searched_parameters_without_a_column_must_be_spoken_of(scenario, events):
    with refuses(InputError, "others", "cut_in_distance"):
        fit_exposure(scenario, {name: values[:60] for name, values in events.items()})


def _csv(path, events, count=60, also=""):
    events = {name: events[name] for name in ("ego_speed", "gap")}
    head = ",".join(events) + (",id" if also else "")
    columns = [values[:count] for values in events.values()]
    rows = [",".join(f"{x:.6f}" for x in row) + also for row in zip(*columns, strict=True)]
    path.write_text("\n".join([head, *rows]) + "\n", "utf-8")
    return path


def _run(monkeypatch, capsys, *words):
    monkeypatch.setattr("sys.argv", ["bridgegen", *map(str, words)])
    status = 0
    try:
        main()
    except SystemExit as end:
        status = end.code or 0
    out = capsys.readouterr()
    return status, out.out, out.err


def test_the_command_writes_exposure_page_and_distribution(tmp_path, events, monkeypatch, capsys):
    table = _csv(tmp_path / "events.csv", events, also=",x1")
    words = ["fit", "cut-in", table, "--others", "default", "--hours", "9", "--replicates", "20"]
    words += ["--out", tmp_path / "e.yaml"]
    status, _, err = _run(monkeypatch, capsys, *words)
    assert status == 2
    approve(err, "id", "cut-in", "--ignore")
    words += ["--ignore", "id"]
    status, out, err = _run(monkeypatch, capsys, *words, "--xosc", tmp_path / "d.xosc")
    assert status == 0
    approve(out, "60")
    approve(err, "OpenSCENARIO")
    page = (tmp_path / "e.html").read_text("utf-8")
    assert page.count("<svg") == 4 + 1  # the logo
    assert "<script" not in without_theme(page)
    assert "nan" not in page.lower().replace("deviation", "")
    status, out, _ = _run(monkeypatch, capsys, "validate", tmp_path / "e.yaml")
    assert (status, "valid" in out) == (0, True)
    status, out, _ = _run(monkeypatch, capsys, *words, "--json")  # an earlier fit is replaced
    assert (status, json.loads(out)["used"]) == (0, 60)
    (tmp_path / "e.yaml").write_text("exposure_of: mine\n", "utf-8")
    status, _, err = _run(monkeypatch, capsys, *words)
    assert (status, "is not overwritten" in err) == (2, True)


def test_inside_an_odd_the_events_outside_are_left_out(tmp_path, events, monkeypatch, capsys):
    table = _csv(tmp_path / "events.csv", events, count=200)
    (tmp_path / "slow.yaml").write_text(
        "ODD:\n  m:\n    INCLUDE_AND:\n      operational_speed: '<= 100 km/h'\n", "utf-8"
    )
    status, out, err = _run(
        monkeypatch, capsys, "fit", "cut-in", table, "--others", "default", "--replicates", "20",
        "--odd", tmp_path / "slow.yaml", "--out", tmp_path / "e.yaml", "--json",
    )  # fmt: skip
    assert status == 0, err
    assert json.loads(out)["used"] == int((events["ego_speed"][:200] <= 100 / 3.6).sum())
    assert "Inside the ODD slow." in (tmp_path / "e.yaml").read_text("utf-8")


def test_the_distribution_is_read_as_the_fit(tmp_path, events, monkeypatch, capsys):
    table = _csv(tmp_path / "events.csv", events, count=200)
    _run(
        monkeypatch, capsys, "fit", "cut-in", table, "--others", "default", "--replicates", "20",
        "--out", tmp_path / "e.yaml", "--xosc", tmp_path / "d.xosc",
    )  # fmt: skip
    fitted = read_exposure(tmp_path / "e.yaml")
    file = read_distribution(tmp_path / "d.xosc")
    assert file.scenario_file.filepath == "cut-in.xosc"
    shares = np.linspace(0.01, 0.99, 25)
    for one in file.definition.distributions:
        theirs = distribution_of(one.distribution).value(shares)
        marginal = fitted.marginals[one.parameter_name]
        ours = marginal.value(np.minimum(shares, 1 - shares), shares > 0.5)
        width = marginal.high - marginal.low
        assert np.abs(theirs - ours).max() < 0.01 * width  # a bin, where it is a histogram


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("", "must begin with the names of its columns"),
        ("gap,gap\n1,2\n", "names, each its own, got 'gap'"),
        ("gap\n30\n\n31 m\n32 s\n", "got '32 s' (TABLE, line 5)"),
        ("gap\nnan\n", "got 'nan' (TABLE, line 2)"),
        ("gap\n1,2\n", "a row must have 1 cells, got 2 (TABLE, line 2)"),
        ('gap\n"3\n', "not CSV"),
        ("gap\n\xff\n", "not UTF-8"),
    ],
)
def test_a_broken_table_is_refused_with_its_line(scenario, tmp_path, text, rule):
    path = tmp_path / "events.csv"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(BridgeGenError) as error:
        fit_exposure(scenario, path, others="default")
    assert rule.replace("TABLE", str(path)) in str(error.value)


def test_parameters_without_a_column_may_be_bound_by_what_follows_later():
    """In crossroads-s1 the weather, which follows from others, bounds the ego's speed."""
    speeds = np.random.default_rng(4).uniform(0.8, 3.3, 60)
    fit = fit_exposure(load("crossroads-s1"), {"bv_speed": speeds}, others="uniform", replicates=20)
    assert fit.used == 60
    assert fit.exposure.sample(100, 1).X.shape[0] == 100
