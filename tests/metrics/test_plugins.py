"""Metrics that installed packages add."""

import sys
from functools import partial

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.assess import metrics
from bridgegen.assess.conflict import quantities
from bridgegen.assess.metrics import Metric
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.simulation.rollout import Rollout


def top_speed(rollout: Rollout) -> np.ndarray:
    fastest = rollout.v[:, 0].max(axis=1)
    return np.where(rollout.status == 0, fastest, np.nan)


def made(name: str, compute: object) -> Metric:
    return Metric(name, "m/s", "largest speed of the ego", "larger", 0.0, compute)


TOP = made("top_speed", top_speed)
FAILS = made("fails", lambda rollout: 1 / 0)
WRONG_SHAPE = made("wrong_shape", lambda rollout: np.zeros((2, 2)))
ALL_NAN = made("all_nan", lambda rollout: np.full(rollout.shape[0], np.nan))


@pytest.fixture
def installed(declare_entry_points):
    sys.modules.setdefault(__name__, sys.modules[__name__])
    return partial(declare_entry_points, metrics.METRICS, "bridgegen.metrics", __name__)


def test_a_package_adds_its_own(installed, driven):
    rollout = driven()
    installed(top_speed="TOP")
    assert list(metrics.METRICS)[-1] == "top_speed"
    assert quantities.get("top_speed").unit == "m/s"
    found = quantities.evaluate(rollout, ["harm", "top_speed", "d_min"])
    assert found[:, 1] == pytest.approx(top_speed(rollout))
    with refuses(UnknownNameError, "top_speed"):
        metrics.get("top_sped")


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("gone", "Nothing", "cannot be loaded: AttributeError"),
        ("not_one", "top_speed", "must be a bridgegen.assess.metrics.Metric, got function"),
        ("other", "TOP", "has the name 'top_speed'"),
        ("fails", "FAILS", "fails: ZeroDivisionError"),
        ("wrong_shape", "WRONG_SHAPE", r"must return \d+ numbers.*\(2, 2\)"),
        ("all_nan", "ALL_NAN", "must be NaN exactly where a scenario failed"),
    ],
)
def test_a_package_that_is_wrong_is_named(installed, driven, name, value, message):
    installed(**{name: value})
    with pytest.raises(InputError, match=f"metric '{name}'.*{message}"):
        metrics.evaluate(driven(), [name])


def test_ours_keep_their_names(installed):
    installed(ttc="TOP")
    assert metrics.get("ttc").unit == "s"


def test_a_package_that_is_installed_meanwhile_is_found(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    assert "late" not in metrics.METRICS
    info = tmp_path / "late-1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: late\nVersion: 1\n")
    (info / "entry_points.txt").write_text("[bridgegen.metrics]\nlate = late:METRIC\n")
    assert "late" in metrics.METRICS
