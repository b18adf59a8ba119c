"""Stable-Baselines3's DDPG and DQN as learners. Imported only when one is constructed."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import torch
from gymnasium import spaces
from stable_baselines3 import DDPG, DQN
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm

from bridgegen.base.arrays import Float
from bridgegen.search.algorithms.observation import Observation, step_from
from bridgegen.search.rl.models import Arrays, Spaces, arrays_of, silent


class _DDPG(DDPG):
    def _update_learning_rate(self, optimizers: Any) -> None:
        """Keep the optimisers' own learning rates."""


class _Remembering:
    """A model that learns from a buffer of bounded size.

    Args:
        model: with a replay buffer of its own.
        optimizers: of the model.
        epochs: gradient steps after a batch.
    """

    def __init__(
        self, model: OffPolicyAlgorithm, optimizers: Iterable[torch.optim.Optimizer], epochs: int
    ) -> None:
        silent(model)
        self._model, self._epochs = model, epochs
        self._asked: tuple[npt.NDArray[Any], npt.NDArray[Any]] | None = None
        assert model.replay_buffer is not None
        self._buffer = buffer = model.replay_buffer
        self.arrays: Arrays = arrays_of(model.policy, optimizers) | {
            "memory observation": buffer.observations,
            "memory next": buffer.next_observations,
            "memory action": buffer.actions,
            "memory reward": buffer.rewards,
        }

    def learn(self, reward: npt.NDArray[np.float32], observation: Observation, batch: int) -> None:
        """Store the batch and train; see `Learner`."""
        assert self._asked is not None
        before, action = self._asked
        buffer, n = self._buffer, len(reward)
        # The batch's number determines the buffer's write position, which needs no saving.
        buffer.pos, buffer.full = (batch - 1) % buffer.buffer_size, batch > buffer.buffer_size
        buffer.add(before, observation, action, reward, np.zeros(n), [{}] * n)
        self._model.train(self._epochs, batch_size=n)


class DDPGLearner(_Remembering):
    """An actor, a critic, their targets, and the replay buffer.

    Args:
        values: of the settings.
        n_var: searched parameters.
        n_obs: numbers in an observation.
    """

    def __init__(self, values: Mapping[str, Any], n_var: int, n_obs: int) -> None:
        n, width = values["population"], values["width"]
        self._step, self._encoding, self._noise = values["step"], values["action"], values["noise"]
        model = _DDPG(
            "MlpPolicy",
            Spaces(n, n_obs, spaces.Box(-1.0, 1.0, (n_var,), np.float32)),
            buffer_size=values["memory"],
            gamma=values["gamma"],
            tau=values["tau"],
            policy_kwargs={"net_arch": [width, width]},
            device="cpu",
        )
        self._actor = model.actor
        optimizers = model.actor.optimizer, model.critic.optimizer
        for optimizer, rate in zip(
            optimizers, (values["lr_actor"], values["lr_critic"]), strict=True
        ):
            optimizer.param_groups[0]["lr"] = rate
        super().__init__(model, optimizers, values["epochs"])

    def rows(self, U: Float, observation: Observation, batch: int) -> Float:
        """Return the actor's choices with noise; see `Learner`."""
        kept = observation.copy()
        self._actor.set_training_mode(False)
        with torch.no_grad():
            chosen = self._actor(torch.from_numpy(kept))
            action = (chosen + self._noise * torch.randn_like(chosen)).clamp(-1.0, 1.0).numpy()
        self._asked = kept, action
        if self._encoding == "row":
            rows: Float = (action.astype(np.float64) + 1.0) / 2.0
            return rows
        return step_from(U, self._step * action.astype(np.float64))


class DQNLearner(_Remembering):
    """A Q-network, its target, and the replay buffer.

    Args:
        values: of the settings.
        n_var: searched parameters.
        n_obs: numbers in an observation.
    """

    def __init__(self, values: Mapping[str, Any], n_var: int, n_obs: int) -> None:
        n, width = values["population"], values["width"]
        self._moves = values["step"] * np.vstack([np.eye(n_var), -np.eye(n_var)])
        self._epsilon, self._explore = values["epsilon"], values["explore"]
        model = DQN(
            "MlpPolicy",
            Spaces(n, n_obs, spaces.Discrete(len(self._moves))),
            learning_rate=values["lr_critic"],
            buffer_size=values["memory"],
            gamma=values["gamma"],
            tau=values["tau"],
            target_update_interval=n,
            policy_kwargs={"net_arch": [width, width]},
            device="cpu",
        )
        self._dqn = model
        super().__init__(model, [model.policy.optimizer], values["epochs"])

    def rows(self, U: Float, observation: Observation, batch: int) -> Float:
        """Take the best action for every observation, or a random one; see `Learner`."""
        kept, n = observation.copy(), len(observation)
        with torch.no_grad():
            best = self._dqn.q_net(torch.from_numpy(kept)).argmax(dim=1)
        epsilon = self._epsilon ** min(1.0, (batch - 1) / self._explore)
        tries, any_one = torch.rand(n), torch.randint(len(self._moves), (n,))
        action = torch.where(tries < epsilon, any_one, best).numpy()
        self._asked = kept, action
        return step_from(U, self._moves[action])

    def learn(self, reward: npt.NDArray[np.float32], observation: Observation, batch: int) -> None:
        """Update the target, store the batch and train; see `Learner`."""
        self._dqn._on_step()
        super().learn(reward, observation, batch)
