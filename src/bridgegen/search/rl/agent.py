"""Base of PPO, DDPG and DQN: batches of episodes; and the state of a learner as arrays."""

import json
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, Protocol

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Float
from bridgegen.search.algorithms.algorithm import Arity, Problem, Results, Setting, Value, resolve
from bridgegen.search.algorithms.observation import ENCODINGS, Observation, Observer, Reward
from bridgegen.search.algorithms.sampling import latin_hypercube

# --- Episodes side by side: the environments of a deep reinforcement learner, one batch each step -


class Walkers:
    """n rows, each in an episode of its own, and the best rows so far, where episodes begin.

    An episode ends after ``horizon`` steps, or at a row that fails, and the next one begins at one
    of the ``elite`` best evaluated rows, drawn at random. No state is terminal: rewards could
    continue, so that every end is a truncation. The walkers' episodes are staggered, so that every
    batch begins equally many.

    Starting from good states: Salimans and Chen (2018), arXiv:1812.03381; Ecoffet et al. (2021),
    doi:10.1038/s41586-020-03157-9.

    Attributes:
        U: ``(n, n_var)`` float64, the walkers' positions.
        observation: ``(n, size)`` float32, their observations.
        reward: the scale of rewards.
    """

    def __init__(self, problem: Problem, n: int, horizon: int, elite: int) -> None:
        self._observe, self._horizon = Observer(problem), horizon
        size = self._observe.size
        self.reward = Reward()
        self.U = np.zeros((n, problem.n_var))
        self.observation = np.zeros((n, size), np.float32)
        self._age = np.arange(n) % horizon
        self._best_U = np.zeros((elite, problem.n_var))
        self._best_observation = np.zeros((elite, size), np.float32)
        self._best_F = np.full(elite, np.inf)  # ascending; inf where there is none yet

    @property
    def arrays(self) -> dict[str, npt.NDArray[np.generic]]:
        """Their whole state, to be read or changed in place."""
        return {
            "U": self.U,
            "observation": self.observation,
            "scale": self.reward.scale,
            "age": self._age,
            "best_U": self._best_U,
            "best_observation": self._best_observation,
            "best_F": self._best_F,
        }

    @property
    def size(self) -> int:
        """Numbers in an observation."""
        return self._observe.size

    def step(
        self, U: Float, results: Results, rng: np.random.Generator
    ) -> tuple[npt.NDArray[np.float32], Observation]:
        """Move to the evaluated rows, and begin new episodes where some have ended.

        Returns:
            ``(n,)`` rewards, and ``(n, size)`` observations there, before new episodes begin.
        """
        F = np.asarray(results.F[:, 0], np.float64)
        good = results.ok & np.isfinite(F)
        reward = self.reward(F, good)
        observation = self._observe(U, results.metrics)
        self._keep(U[good], observation[good], F[good])
        self.U[:], self.observation[:] = U, observation
        self._age += 1
        begin = np.flatnonzero((self._age >= self._horizon) | ~good)
        known = int(np.isfinite(self._best_F).sum())
        if known:
            pick = rng.integers(known, size=len(begin))
            self.U[begin] = self._best_U[pick]
            self.observation[begin] = self._best_observation[pick]
        self._age[begin] = 0
        return reward, observation

    def _keep(self, U: Float, observation: Observation, F: Float) -> None:
        """Update the best rows by these, each once."""
        U = np.concatenate([self._best_U, U])
        observation = np.concatenate([self._best_observation, observation])
        F = np.concatenate([self._best_F, F])
        seen: set[bytes] = set()
        best: list[int] = []
        for k in np.argsort(F, kind="stable").tolist():
            row = U[k].tobytes()
            if len(best) == len(self._best_F) or not np.isfinite(F[k]):
                break
            if row not in seen:
                seen.add(row)
                best.append(k)
        self._best_U[: len(best)] = U[best]
        self._best_observation[: len(best)] = observation[best]
        self._best_F[: len(best)] = F[best]


# --- The state of a learner, as plain arrays: it is never executed ---


class Saved:
    """An algorithm whose next rows depend on arrays alone; see `Restorable`.

    The arrays are its working state, in one order, with constant shapes.
    """

    name: ClassVar[str]
    _values: Mapping[str, Any]
    _arrays: Mapping[str, npt.NDArray[Any]]

    def state(self) -> bytes:
        """Return networks, optimisers, memory and walkers: a line of JSON, then plain arrays."""
        return self._header() + b"".join(array.tobytes() for array in self._arrays.values())

    def restore(self, state: bytes) -> None:
        """Restore the state of an algorithm.

        Raises:
            ValueError: the state is of another algorithm, other settings or metrics, other versions
                of its libraries; or it is damaged.
        """
        header, arrays = self._header(), self._arrays.values()
        if not state.startswith(header):
            raise ValueError(f"it is not a state of {self.name} with these settings and metrics")
        if len(state) != len(header) + sum(array.nbytes for array in arrays):
            raise ValueError("it has the wrong length")
        parts, at = [], len(header)
        for array in arrays:
            part = np.frombuffer(state, array.dtype, array.size, at).reshape(array.shape)
            if part.dtype.kind == "f" and np.isnan(part).any():
                raise ValueError("it holds NaN")
            parts.append(part)
            at += array.nbytes
        for array, part in zip(arrays, parts, strict=True):
            array[...] = part

    def _header(self) -> bytes:
        shapes = [[key, array.dtype.str, array.shape] for key, array in self._arrays.items()]
        return json.dumps([self.name, self._values, shapes]).encode() + b"\n"


COMMON = {
    "population": Setting(40, "environments side by side, and rows per batch", 2, 10_000),
    "horizon": Setting(2, "steps of an episode", 1, 10_000),
    # Episodes that begin at the best 40 rows instead of 10: R_critic 0.818 instead of 0.895 on S1,
    # 0.709 instead of 0.805 on S4; after the first batch the best 40 of 40 are all.
    "elite": Setting(10, "best rows so far, at one of which an episode begins", 1, 10_000),
    "gamma": Setting(0.99, "discount of future rewards", 0.0, 1.0),
    "width": Setting(64, "units in each of the networks' two hidden layers", 1, 4096),
}
"""Settings of all reinforcement-learning algorithms."""

# 0.2 instead of 0.1: R_critic 0.737 instead of 0.818 on S1, 0.624 instead of 0.709 on S4 (2 seeds).
STEP = Setting(0.1, "size of a step, as a share of each parameter's range", 1e-4, 1.0)
MEMORY = Setting(2000, "size of the replay buffer, in transitions", 1, 1_000_000)
ACTION = Setting("step", "what an action is: a step from the last row, or a row", choices=ENCODINGS)


class Learner(Protocol):
    """A model of Stable-Baselines3 without its own training loop."""

    @property
    def arrays(self) -> dict[str, npt.NDArray[Any]]:
        """The arrays that determine its next actions, to be read or changed in place."""
        ...

    def rows(self, U: Float, observation: Observation, batch: int) -> Float:
        """Return the rows that the agents choose, ``(n, n_var)`` in [0, 1].

        Args:
            U: ``(n, n_var)``, their positions.
            observation: ``(n, size)``, their observations there.
            batch: its number, 1 for the first.
        """
        ...

    def learn(self, reward: npt.NDArray[np.float32], observation: Observation, batch: int) -> None:
        """Learn from the rows' rewards and observations."""
        ...


class Agent(Saved, ABC):
    """Deep reinforcement learning as a search: the generator of scenarios is the agent.

    Observation: the last row and its metrics. Action: a row, or a step from the last one. Reward:
    −F. A batch is one step of ``population`` environments. The first batch is a Latin hypercube;
    see `Walkers` for episodes, `Observer` and `Reward` for observations and rewards.

    Every batch draws from generators seeded by the search's seed and its own number.
    """

    name: ClassVar[str]
    description: ClassVar[str]
    source: ClassVar[str]
    settings: ClassVar[Mapping[str, Setting]]
    objectives: ClassVar[Arity] = "one"
    extra: ClassVar[str] = "rl"

    def __init__(self, problem: Problem, seed: int, **settings: Value) -> None:
        self._values = resolve(type(self), problem, seed, settings)
        values, self._problem, self._seed = self._values, problem, seed
        from bridgegen.search.rl.models import own_generators

        self._own = own_generators
        self._walkers = Walkers(problem, values["population"], values["horizon"], values["elite"])
        with self._own((seed, 0)):
            self._learner = self._build(problem.n_var, self._walkers.size)
        self._batch = np.zeros(1, np.int64)
        self._arrays = {"batch": self._batch, **self._walkers.arrays, **self._learner.arrays}

    @abstractmethod
    def _build(self, n_var: int, n_obs: int) -> Learner:
        """Return a new learner, whose random numbers depend on this search's seed only."""

    def ask(self) -> Float:
        """Return the rows that the agents choose; first, a Latin hypercube."""
        batch, walkers = int(self._batch[0]), self._walkers
        if batch == 0:
            return latin_hypercube(self._rng(1), len(walkers.U), self._problem.n_var)
        with self._own((self._seed, 2, batch)):
            return self._learner.rows(walkers.U, walkers.observation, batch)

    def tell(self, U: Float, results: Results) -> None:
        """Reward the agents, and train them."""
        batch = int(self._batch[0])
        reward, observation = self._walkers.step(U, results, self._rng(3))
        if batch:
            with self._own((self._seed, 4, batch)):
                self._learner.learn(reward, observation, batch)
        self._batch += 1

    def _rng(self, purpose: int) -> np.random.Generator:
        seed = (self._seed, purpose, int(self._batch[0]))
        return np.random.Generator(np.random.PCG64(seed))
