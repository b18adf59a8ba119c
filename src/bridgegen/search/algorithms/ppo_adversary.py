"""An adversary in closed loop: an agent that drives a participant, trained by PPO."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from bridgegen.assess.cause import Cause
from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError
from bridgegen.search.algorithms.algorithm import Arity, Problem, Results, Setting, Value, resolve
from bridgegen.search.algorithms.observation import Reward, step_from
from bridgegen.search.algorithms.sampling import latin_hypercube
from bridgegen.search.rl.agent import Saved


class PPOAdversary(Saved):
    """An agent that drives a participant step by step, rewarded for harm the ego could avoid.

    Every half second it observes the ego's position and speed, and where their paths meet, and
    decides on its target speed and lateral position in its lane, within the scenario's limits. It
    drives 40 scenarios at a time and learns from all its decisions in them. The scenario's other
    parameters (its start, the weather) are drawn at random for one half of them, and near the best
    so far for the other.

    Its reward comes at the end of the scenario: −F, and ``BONUS`` more if the scenario is critical
    and the ego could have avoided it; harm that no careful driver would have avoided (`Cause`)
    gets the reward of an average scenario. Without cause analysis, all harm counts.

    Source: Schulman et al. (2017), "Proximal policy optimization algorithms"; against a driver in
    closed loop: Feng et al. (2021), "Intelligent driving intelligence test".
    """

    name: ClassVar[str] = "ppo-adversary"
    description: ClassVar[str] = "an agent drives a participant in closed loop (PPO; extra rl)"
    source: ClassVar[str] = (
        "Schulman et al. (2017), arXiv:1707.06347; Feng et al. (2021), "
        "doi:10.1038/s41467-021-21007-8"
    )
    settings: ClassVar[Mapping[str, Setting]] = {
        "population": Setting(40, "scenarios side by side, and rows per batch", 2, 10_000),
        "epochs": Setting(32, "passes over a batch's decisions, K_epochs", 1, 1000),
        "minibatch": Setting(
            400, "maximum number of decisions per update; updates have equal shares", 2, 100_000
        ),
        "gamma": Setting(0.99, "discount of future rewards", 0.0, 1.0),
        "gae": Setting(0.95, "lambda of generalised advantage estimation", 0.0, 1.0),
        "lr_actor": Setting(3e-4, "learning rate of the policy", 0.0, 1.0),
        "lr_critic": Setting(1e-3, "learning rate of the value function", 0.0, 1.0),
        "lr_std": Setting(3e-3, "learning rate of the standard deviations", 0.0, 1.0),
        "std": Setting(1.0, "initial standard deviation of the policy", 1e-3, 10.0),
        "clip": Setting(0.2, "how far an update may change an action's probability", 1e-3, 1.0),
        "entropy": Setting(0.0, "weight of the policy's entropy", 0.0, 1.0),
        "width": Setting(64, "units in each of the networks' two hidden layers", 1, 4096),
        "elite": Setting(40, "best scenarios so far, near which others start", 1, 10_000),
        "near": Setting(0.1, "how near, as a share of each parameter's range", 1e-4, 1.0),
    }
    objectives: ClassVar[Arity] = "one"
    extra: ClassVar[str] = "rl"
    is_adversary: ClassVar[bool] = True

    BONUS = 2.0

    def __init__(self, problem: Problem, seed: int, **settings: Value) -> None:
        values = self._values = resolve(type(self), problem, seed, settings)
        if problem.arena is None:
            raise InputError(f"{self.name}: the scenario must have an adversary, got none")
        from bridgegen.search.rl.duel import Duel
        from bridgegen.search.rl.models import own_generators

        self._arena, self._seed, self._own = problem.arena, seed, own_generators
        self._n_var = problem.n_var
        with self._own((seed, 0)):
            self._duel = Duel(values, problem.arena)
        self._reward, self._batch = Reward(), np.zeros(1, np.int64)
        self._best_U = np.zeros((values["elite"], problem.n_var))
        self._best = np.full(values["elite"], -np.inf)  # descending; -inf where there is none yet
        self._arrays = {
            "batch": self._batch,
            "scale": self._reward.scale,
            "best_U": self._best_U,
            "best": self._best,
            **self._duel.arrays,
        }

    def ask(self) -> Float:
        """Drive the next scenarios, and return them as rows."""
        batch, n = int(self._batch[0]), int(self._values["population"])
        rng = np.random.Generator(np.random.PCG64((self._seed, 1, batch)))
        U = latin_hypercube(rng, n, self._n_var)
        known = int(np.isfinite(self._best).sum())
        if known:
            half = np.arange(n // 2)
            near = self._best_U[rng.integers(known, size=len(half))]
            U[half] = step_from(near, self._values["near"] * rng.standard_normal(near.shape))
        # The agent plays the scenario to fill the row; the campaign then evaluates the row like any
        # other, so store, resumption and export need no second path.
        with self._own((self._seed, 2, batch)):
            self._duel.begin()
            return self._arena.play(U, self._duel.act)

    def tell(self, U: Float, results: Results) -> None:
        """Reward the agent, and train it."""
        F = np.asarray(results.F[:, 0], np.float64)
        good = results.ok & np.isfinite(F)
        reward = self._reward(F, good).astype(np.float64)
        avoidable = results.critical & (results.cause != Cause.UNAVOIDABLE)
        # A failure that remains with a more careful driver in the ego's place shows nothing of the
        # ego, so it is worth no more than an average scenario.
        reward[avoidable] += self.BONUS
        reward[results.critical & ~avoidable] = 0.0
        ranked = np.where(good, reward, -np.inf)
        whole, rows = np.concatenate([self._best, ranked]), np.concatenate([self._best_U, U])
        best = np.argsort(-whole, kind="stable")[: len(self._best)]
        self._best[:], self._best_U[:] = whole[best], rows[best]
        with self._own((self._seed, 3, int(self._batch[0]))):
            self._duel.learn(reward.astype(np.float32))
        self._batch += 1
