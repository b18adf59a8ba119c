"""A scenario with a driver as a function of its parameters: ``bg.model``."""

import numpy as np
import pytest
from tests.approval import approve, refuses

import bridgegen as bg
from bridgegen.base.errors import InputError, UnknownNameError


@pytest.fixture(scope="module")
def model():
    return bg.model("cut-in", ego="route-follower")


def plain(frame):
    """Return a data frame whose missing texts are all the same."""
    return frame.astype(object).fillna("")


def test_its_rows_are_those_of_a_search_to_the_last_bit(model, tmp_path):
    run = bg.run_search(
        "cut-in", ego="route-follower", algorithm="random", budget=40, seed=3, triage="none",
        out=tmp_path / "run", deliver=False,
    )  # fmt: skip
    searched = run.frame()
    found = model.evaluate(searched[[*model.columns]])
    assert found.index.equals(searched.index)
    assert found.critical.sum() > 0
    for name in ("harm", "d_min", "severity", "critical", "conflict_type", "implausible"):
        assert plain(found[[name]]).equals(plain(searched[[name]])), name
    alone = model.evaluate(found[[*model.columns]].iloc[[7]])
    assert plain(alone).equals(plain(found.iloc[[7]]))


def test_a_row_of_its_results_can_be_watched(model):
    found = model.evaluate(model.sample(300, seed=1))
    worst = found.sort_values("harm").iloc[-1]
    motion = model.rollout(worst)
    assert motion.rollout.shape[0] == 1
    assert motion.rollout.distance.min() == pytest.approx(worst.d_min, abs=1e-9)
    assert motion.conflict is not None
    assert motion.conflict.type == worst.conflict_type
    assert motion._repr_svg_().startswith("<svg")
    assert model.rollout().values["gap"] == model.parameters["gap"][2]
    row = worst[[*model.columns]].to_numpy(dtype=np.float64)
    assert model.rollout(row).rollout.x.tobytes() == motion.rollout.x.tobytes()


def test_what_is_not_given_has_its_default(model):
    found = model.evaluate({"gap": [20.0, 40.0]})
    assert found.gap.tolist() == [20.0, 40.0]
    assert found.ego_speed.tolist() == [25.0, 25.0]
    assert len(model.evaluate({})) == 1
    assert len(model.evaluate(model.sample(0))) == 0


@pytest.mark.parametrize(
    ("X", "says"),
    [
        ({"gap": [20.0, 1e9]}, "gap"),
        ({"gap": [float("nan")]}, "gap"),
        ({"gap": ["near"]}, "near"),
        ({"gap": [None]}, "nan"),
        ({"gap": [20.0], "ego_speed": [20.0, 21.0]}, "columns"),
        ({"precipitation": [50.0], "cloudiness": [10.0]}, "cloudiness"),
        (np.zeros((2, 3)), "20"),
    ],
)
def test_rows_that_break_a_rule_are_refused_with_it(model, X, says):
    with refuses(InputError, says):
        model.evaluate(X)


def test_unknown_names_are_refused(model):
    with refuses(UnknownNameError, "gab"):
        model.evaluate({"gab": [1.0]})
    with refuses(UnknownNameError, "egg"):
        bg.model("cut-in", egg="careful")


def test_it_says_that_its_driver_is_outside_its_domain():
    approve(bg.model("crossroads-s1", ego="un-r157").notes[-1], "un-r157")
