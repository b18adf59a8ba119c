"""A stand-in for a pipeline: what is harmful is a formula of the row and of the fix."""

from copy import copy
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from bridgegen.assess.cause import Cause
from bridgegen.assess.conflict.findings import Findings
from bridgegen.engine.trials import EVENT, Trials
from bridgegen.scenario.language.parameters import Axis
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.language.space import SearchSpace

METRICS = ("harm", "severity", "course_ttc", "course_braking")


@dataclass(frozen=True, eq=False)
class Rows:
    id: np.ndarray
    U: np.ndarray
    X: np.ndarray
    metrics: np.ndarray
    status: np.ndarray
    critical: np.ndarray
    cause: np.ndarray
    findings: Findings

    def digest(self):
        return "the rows"

    def take(self, at):
        return Rows(*(getattr(self, n)[at] for n in tuple(self.__dict__)[:-1]),
                    self.findings.take(at))  # fmt: skip


def fix(cause, name, dry=False):
    return SimpleNamespace(cause=cause, driver=SimpleNamespace(name=name), dry=dry)


class World:
    """A pipeline whose harm is ``harm(values, fix)`` of the rows; ``label`` names their type."""

    cause, baseline, seeks_causes, tries, metrics = None, None, True, True, METRICS
    preventable, draws, left_hand = True, False, False

    def __init__(
        self, space, harm, fixes=(), label=None, fails=None, seen=(), spoiled=None, rule=None
    ):
        self.space, self._harm, self.fixes, self._label = space, harm, tuple(fixes), label
        self._seen, self._spoiled, self._rule = seen, spoiled, rule
        self.embedded, self.at_step = SimpleNamespace(time_step=0.05), lambda v, steps, harm: harm
        self.steps = 1
        self._fails, self.kinds = fails, {"ego": "car", "bv": "truck"}
        self.scenario = SimpleNamespace(name="planted", checks=())
        self.driver = SimpleNamespace(label="driver")
        self.objective = SimpleNamespace(harm="harm", count="ego", rule="harm")
        self.asked = []

    @property
    def runner(self):
        """The stand-in of the runner is the same."""
        return self

    def elsewhere(self, simulator):
        other = copy(self)
        other.steps = simulator.finer
        return other

    def values(self, X):
        return {name: X[:, k] for k, name in enumerate(self.space.names)}

    def try_all(self, X, fix=None, noise=None):
        n = len(X)
        fix = np.full(n, -1) if fix is None else fix
        self.asked.append((X, fix, noise))
        v = self.values(X)
        ok = np.ones(n, bool)
        if self._fails is not None:
            ok = ~(self._fails(v) if self._spoiled is None else self._fails(v, fix))
        harm = np.where(ok, self.at_step(v, self.steps, self._harm(v, fix)), 0.0)
        kind = np.full(n, "front-to-rear striking", object)
        if self._label is not None:
            kind = np.asarray(self._label(v), object)
        texts = [np.full(n, one, object) for one in ("contact", "ego", "rear distance", "bv", "")]
        if self._rule is not None:
            texts[2] = np.asarray(self._rule(v), object)
        findings = Findings(texts[0], kind, *texts[1:])
        # What happens follows from the parameters that are seen.
        event = np.zeros((n, len(EVENT)))
        for k, name in enumerate(self._seen or self.space.variables):
            event[:, k % 7] += v[name]
        until = np.where(ok, np.where(harm >= 0.3, 2.0, np.inf), -np.inf)
        if self._spoiled is not None:
            until = np.where(ok, until, self._spoiled)
        return Trials(harm, 0.1 * harm, ok, findings, np.full(n, "", object), event,
                      np.full(n, self.preventable), until)  # fmt: skip

    def noise_keys(self, X):
        return (1e6 * np.abs(X).sum(axis=1)).astype(np.uint64)

    def facts(self, x):
        return self.space.values(x)

    def rows(self, n, seed=0, U=None):
        if U is None:
            U = np.random.default_rng(seed).random((n, self.space.n_var))
        X = self.space.decode(U)
        came = self.try_all(X)
        metrics = np.stack([came.harm, came.severity, 4.0 - came.harm, came.harm], axis=1)
        cause = np.where(came.harmful, Cause.PLANNING, Cause.NONE).astype(np.int8)
        return Rows(np.arange(n), U, X, metrics, (~came.ok).astype(int), came.harmful, cause,
                    came.findings)  # fmt: skip


@pytest.fixture(scope="session")
def space() -> SearchSpace:
    return load("crossroads-s4").space(("participants",))


@pytest.fixture(scope="session")
def every() -> SearchSpace:
    """With whole numbers, and parameters that limit each other."""
    return load("crossroads-s4").space(tuple(Axis))


@pytest.fixture(scope="session")
def world():
    return World


@pytest.fixture(scope="session")
def fixed():
    """The fixes by which causes are sought, as a driver with perception has them."""
    return (
        fix(Cause.PERCEPTION, "driver"),
        fix(Cause.PLANNING, "un-r157"),
        fix(Cause.CONTROL, "driver", dry=True),
    )
