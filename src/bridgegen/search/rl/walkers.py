"""Episodes side by side: the environments of a deep reinforcement learner, one batch each step."""

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Float
from bridgegen.search.algorithms.algorithm import Problem, Results
from bridgegen.search.algorithms.observation import Observation, Observer, Reward


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
