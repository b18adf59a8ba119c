"""By which factor harm is more or less likely in another simulator."""

import json
from dataclasses import dataclass

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import approve, refuses
from tests.campaign.biased import biased_kind, not_finite

from bridgegen.base.errors import InputError, Interrupted
from bridgegen.base.statistics import clopper_pearson
from bridgegen.jobs.frame import JobCallbacks
from bridgegen.jobs.risk import cross_simulator as elsewhere
from bridgegen.jobs.risk.cross_simulator import Group, compare, look_elsewhere, share_of
from bridgegen.jobs.risk.estimators import subset
from bridgegen.jobs.risk.estimators.problem import Aim
from bridgegen.jobs.risk.outcomes import Column
from bridgegen.jobs.risk.risk import estimate_risk
from bridgegen.simulation import choice

pytestmark = pytest.mark.thorough

SCENARIO, DRIVER = "paper/crossroads-s1", "route-follower"
GIVEN = {
    "ego": DRIVER, "exposure": "uniform", "method": "mc", "event": "conflict", "precision": 0.0,
    "budget": 1200,
}  # fmt: skip


@dataclass
class Plane:
    """A world in which the event is z · direction ≥ distance."""

    direction: tuple
    distance: float
    failing: float = 0.0
    dimensions: int = 3
    columns: int = len(Column)
    share: tuple = (1.0, 1.0, 1.0)
    evaluations: int = 0

    def feasible(self, Z):
        return np.ones(len(Z), np.bool_)

    def evaluate(self, Z, least=-np.inf):
        self.evaluations += len(Z)
        found = np.zeros((len(Z), self.columns))
        found[:, Column.SCORE] = Z @ np.asarray(self.direction) - self.distance
        found[:, Column.RESULT] = scipy.stats.norm.cdf(Z[:, 2]) >= self.failing
        return found

    @property
    def probability(self):
        return scipy.stats.norm.sf(self.distance / np.linalg.norm(self.direction))


HERE = (0.8, 0.6, 0.0)


def looked(there, seed, rows=200):
    here = Plane(HERE, 3.0)
    known = subset.estimate(here, Aim(0.0, 0.0, 10_000, 0.2), seed)
    return look_elsewhere(here, there, "other", known, 0.0, rows, seed)


@pytest.mark.parametrize(
    ("direction", "distance"), [(HERE, 2.9), (HERE, 3.1), ((0.85, 0.53, 0.1), 3.0)]
)
def test_its_interval_holds_the_truth(direction, distance):
    there = Plane(direction, distance)
    truth = there.probability / Plane(HERE, 3.0).probability
    found = [looked(Plane(direction, distance), seed) for seed in range(15)]
    assert all(one.factor is not None for one in found)
    held = sum(one.factor.low <= truth <= one.factor.high for one in found)
    assert held >= 13
    assert np.mean([one.factor.estimate for one in found]) == pytest.approx(truth, rel=0.08)
    assert np.mean([one.factor.high / one.factor.low for one in found]) < 1.7


def test_the_budget_there_is_kept():
    there = Plane(HERE, 3.1)
    found = looked(there, 1, rows=37)
    assert there.evaluations == found.rows <= 37


def test_what_is_worse_there_alone_is_counted_as_new():
    milder, worse = looked(Plane(HERE, 3.2), 3), looked(Plane(HERE, 2.8), 3)
    assert milder.confirmed.estimate < 0.7
    assert milder.new.estimate == 0.0
    assert milder.new.high > 0.0
    assert worse.confirmed.estimate == 1.0
    assert worse.new.estimate > 0.4


def test_where_nothing_runs_nothing_is_said():
    found = looked(Plane(HERE, 3.0, failing=0.5), 2)
    assert found.factor is None
    approve(found.doubt, "result")
    assert json.dumps(found.to_dict(), allow_nan=False)
    assert looked(Plane(HERE, 3.0, failing=0.05), 2).failed > 0


def test_few_effective_rows_are_in_doubt():
    none = np.empty(0)
    event = Group(1.0, 8.0, np.ones(8), np.ones(8, bool), np.ones(8, bool))
    found = compare("other", event, Group(0.0, 0.0, none, none > 0, none > 0))
    assert found.factor is None
    approve(found.doubt, "effective")


@given(st.lists(st.booleans(), min_size=1, max_size=60))
def test_equal_weights_have_the_exact_interval(yes):
    found = share_of(np.full(len(yes), 3.5), np.array(yes))
    low, high = clopper_pearson(sum(yes), len(yes))
    assert found.estimate == pytest.approx(np.mean(yes))
    assert (found.low, found.high) == pytest.approx((low, high))


@pytest.fixture
def simulators(monkeypatch):
    def faster(values):
        return values | {"ego_speed": values["ego_speed"] + 1.5}

    for name, change in (("same", dict), ("faster", faster), ("broken", not_finite)):
        monkeypatch.setitem(choice.SIMULATORS, name, biased_kind(name, change))
    monkeypatch.setattr(elsewhere, "HERE", 4000)


def risk(out, **changes):
    return estimate_risk(SCENARIO, out=out, **GIVEN | changes)


def test_a_biased_copy_is_found_out_and_the_same_is_not(simulators, tmp_path):
    same = risk(tmp_path / "same", simulator="same", simulator_rows=100).elsewhere
    assert same.factor.estimate == 1.0
    assert same.factor.low > 0.9
    found = risk(tmp_path / "faster", simulator="faster", simulator_rows=200)
    truth = counted_faster(found)
    assert found.elsewhere.factor.low <= truth <= found.elsewhere.factor.high
    assert not found.elsewhere.factor.low <= 1.0 <= found.elsewhere.factor.high
    said = json.loads((found.folder / "risk.json").read_text())
    assert said["elsewhere"]["simulator"] == "faster"
    approve(said["command"], "--simulator", "--simulator-rows")
    assert "In faster the event is" in (found.folder / "risk.html").read_text()


def counted_faster(found):
    """Return the factor that counting the same rows in both finds."""
    from bridgegen.engine.options import PipelineOptions
    from bridgegen.engine.pipeline import Pipeline
    from bridgegen.jobs.risk.outcomes import outcomes

    met = found.exposure
    X = met.sample(3000, 3).X
    hits = []
    for one in ("embedded", "faster"):
        pipeline = Pipeline(
            met.scenario, met.space, PipelineOptions(ego=DRIVER),
            simulator=choice.SimulatorChoice(one),
        )  # fmt: skip
        hits.append(np.sum(outcomes(pipeline, X, "ego").values[:, Column.SCORE] >= 0.3))
    return hits[1] / hits[0]


def test_stopped_there_and_gone_on_it_is_the_same(simulators, tmp_path):
    def stop(what, done, total, facts):
        if what == "elsewhere" and done >= 40:
            raise KeyboardInterrupt

    given = {"simulator": "faster", "simulator_rows": 100}
    whole = risk(tmp_path / "whole", **given)
    with pytest.raises(Interrupted):
        risk(tmp_path / "two", callbacks=JobCallbacks(progress=stop), **given)
    made = []
    callbacks = JobCallbacks(
        progress=lambda what, done, total, facts: made.append(done) if what == "elsewhere" else None
    )
    again = risk(tmp_path / "two", callbacks=callbacks, **given)
    assert again.elsewhere == whole.elsewhere
    without = risk(tmp_path / "whole")
    assert without.elsewhere is None
    assert without.findings == whole.findings


def test_what_refuses_every_row_has_no_factor(simulators, tmp_path):
    found = risk(tmp_path / "broken", simulator="broken", simulator_rows=6)
    assert found.elsewhere.factor is None
    assert found.elsewhere.failed == found.elsewhere.rows
    assert found.believed


def test_an_event_that_was_not_met_has_nothing_to_look_at(simulators, tmp_path):
    found = risk(tmp_path / "none", ego="careful", budget=40, simulator="same")
    approve(found.elsewhere.doubt)
    assert found.probability("conflict").upper < 0.1


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"simulator": "embedded"}, "compare"),
        ({"simulator": "none"}, "simulator"),
        ({"simulator": "esmini", "simulator_rows": 0}, "--simulator-rows"),
    ],
)
def test_what_is_wrong_is_said(tmp_path, changes, message):
    with refuses(InputError, message):
        risk(tmp_path / "new", **changes)
    assert not (tmp_path / "new").exists()
