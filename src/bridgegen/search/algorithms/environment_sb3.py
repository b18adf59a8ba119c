"""The vectorised environment as Stable-Baselines3 wants it. Needs the extra ``rl``."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from stable_baselines3.common.vec_env import VecEnv

from bridgegen.engine.pipeline import Pipeline
from bridgegen.search.algorithms.environment import Episodes, generators

Indices = int | Iterable[int] | None


class ScenarioVecEnv(VecEnv):
    """Forty environments for a model of Stable-Baselines3's: each step evaluates one batch.

        model = stable_baselines3.PPO("MlpPolicy", ScenarioVecEnv("crossroads-s1"), n_steps=5)
        model.learn(1000)

    As Stable-Baselines3 expects, an episode that has ended begins anew within the same step, which
    evaluates the new first rows in a batch of their own; what was observed at its end is in the
    info "terminal_observation". See `Episodes` for observation, action, reward and ends.

    Args:
        scenario: as for `Episodes`.
        num_envs: environments.
        **settings: as for `Episodes`.
    """

    def __init__(
        self, scenario: str | Path | Pipeline, num_envs: int = 40, **settings: Any
    ) -> None:
        self._episodes = Episodes(scenario, num_envs, **settings)
        self.pipeline, self.render_mode = self._episodes.pipeline, None
        spaces = self._episodes.observation_space, self._episodes.action_space
        super().__init__(num_envs, *spaces)
        self._generators = generators(None, num_envs)
        self._actions: npt.NDArray[Any] = np.zeros((num_envs, self._episodes.n_var))

    def reset(self) -> Any:
        """Start all episodes at random rows; see ``seed``."""
        if any(seed is not None for seed in self._seeds):
            self._generators = generators([seed or 0 for seed in self._seeds], self.num_envs)
        self._reset_seeds()
        self._reset_options()
        U = np.stack([self._episodes.first_row(rng, None) for rng in self._generators])
        observations, *_, infos = self._episodes.move(U, np.ones(self.num_envs, np.bool_))
        self.reset_infos = [self._episodes.of(infos, k) for k in range(self.num_envs)]
        return observations

    def step_async(self, actions: npt.NDArray[Any]) -> None:
        """Take the actions; they are evaluated in ``step_wait``."""
        self._actions = actions

    def step_wait(self) -> Any:
        """Evaluate the rows that the actions lead to, then the first ones of new episodes."""
        episodes, n = self._episodes, self.num_envs
        U = episodes.next_rows(self._actions)
        moved = episodes.move(U, np.zeros(n, np.bool_))
        observations, rewards, terminated, truncated, arrays = moved
        infos = [episodes.of(arrays, k) for k in range(n)]
        ended = terminated | truncated
        if ended.any():
            first = U.copy()
            for k in np.flatnonzero(ended).tolist():
                infos[k]["terminal_observation"] = observations[k]
                infos[k]["TimeLimit.truncated"] = bool(truncated[k])
                first[k] = episodes.first_row(self._generators[k], None)
            observations = np.where(
                ended[:, np.newaxis], episodes.begin(first, ended), observations
            )
        return observations, rewards.astype(np.float32), ended, infos

    def close(self) -> None:
        """Nothing is held."""

    def get_attr(self, attr_name: str, indices: Indices = None) -> list[Any]:
        """Return an attribute of some environments; all have the same."""
        return [getattr(self, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Indices = None) -> None:
        """Refuse: the environments have nothing of their own."""
        raise NotImplementedError("the environments share their settings; make others instead")

    def env_method(
        self, method_name: str, *args: Any, indices: Indices = None, **given: Any
    ) -> list[Any]:
        """Refuse: the environments have no methods of their own."""
        raise NotImplementedError("the environments are one batch; call the vectorised methods")

    def env_is_wrapped(self, wrapper_class: type[Any], indices: Indices = None) -> list[bool]:
        """Say that none is wrapped."""
        return [False for _ in self._get_indices(indices)]
