"""Stable-Baselines3's PPO as a learner. Imported only when it is constructed."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import torch
from gymnasium import spaces
from stable_baselines3 import PPO
from stable_baselines3.common.policies import ActorCriticPolicy

from bridgegen.base.arrays import Float
from bridgegen.search.algorithms.observation import Observation, step_from
from bridgegen.search.rl.models import Arrays, Spaces, arrays_of, silent


class Policy(ActorCriticPolicy):
    """Separate learning rates of actor, critic and standard deviations."""

    def __init__(self, *args: Any, rates: tuple[float, float, float], **given: Any) -> None:
        self._rates = rates
        super().__init__(*args, **given)

    def _build(self, lr_schedule: Any) -> None:
        super()._build(lr_schedule)
        net, (actor, critic, std) = self.mlp_extractor, self._rates
        groups = [
            {"params": [*net.policy_net.parameters(), *self.action_net.parameters()], "lr": actor},
            {"params": [*net.value_net.parameters(), *self.value_net.parameters()], "lr": critic},
            {"params": [self.log_std], "lr": std},
        ]
        self.optimizer = self.optimizer_class(groups, **self.optimizer_kwargs)


class Model(PPO):
    """PPO with the learning rates of its policy."""

    def _update_learning_rate(self, optimizers: Any) -> None:
        """Keep the policy's own learning rates."""


def model_of(
    values: Mapping[str, Any], n_obs: int, n_actions: int, *, n_steps: int, minibatch: int
) -> Model:
    """Return a model that learns from ``n_steps`` steps of every environment.

    Args:
        values: of the settings.
        n_obs: numbers in an observation.
        n_actions: numbers in an action.
        n_steps: of each environment, between two trainings.
        minibatch: steps between two updates.
    """
    width = values["width"]
    model = Model(
        Policy,
        Spaces(values["population"], n_obs, spaces.Box(-1.0, 1.0, (n_actions,), np.float32)),
        n_steps=n_steps,
        batch_size=minibatch,
        n_epochs=values["epochs"],
        gamma=values["gamma"],
        gae_lambda=values.get("gae", 0.95),
        clip_range=values["clip"],
        ent_coef=values["entropy"],
        policy_kwargs={
            "rates": (values["lr_actor"], values["lr_critic"], values["lr_std"]),
            "log_std_init": float(np.log(values["std"])),
            "net_arch": {"pi": [width, width], "vf": [width, width]},
        },
        device="cpu",
    )
    silent(model)
    return model


class PPOLearner:
    """A policy, its value function, and the next batch to learn from.

    Args:
        values: of the settings.
        n_var: searched parameters.
        n_obs: numbers in an observation.
    """

    def __init__(self, values: Mapping[str, Any], n_var: int, n_obs: int) -> None:
        n = values["population"]
        self._step, self._encoding = values["step"], values["action"]
        self._model = model_of(values, n_obs, n_var, n_steps=1, minibatch=n)
        self._asked: tuple[Any, ...] = ()
        self.arrays: Arrays = arrays_of(self._model.policy, [self._model.policy.optimizer])

    def rows(self, U: Float, observation: Observation, batch: int) -> Float:
        """Draw an action for every observation; see `Learner`."""
        kept = observation.copy()
        with torch.no_grad():
            action, value, log_probability = self._model.policy(torch.from_numpy(kept))
        self._asked = kept, action.numpy(), value, log_probability
        if self._encoding == "row":
            rows: Float = torch.special.ndtr(action.double()).numpy()
            return rows
        return step_from(U, self._step * action.double().numpy())

    def learn(self, reward: npt.NDArray[np.float32], observation: Observation, batch: int) -> None:
        """Train on the batch; the value function estimates the rewards after it."""
        model, n = self._model, len(reward)
        kept, action, value, log_probability = self._asked
        with torch.no_grad():
            after = model.policy.predict_values(torch.from_numpy(observation))
        buffer = model.rollout_buffer
        buffer.reset()
        buffer.add(kept, action, reward, np.zeros(n), value, log_probability)
        buffer.compute_returns_and_advantage(last_values=after, dones=np.zeros(n))
        model.train()
