"""Base of the algorithms built on Stable-Baselines3. Imported only when one is constructed."""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np
import numpy.typing as npt
import torch
from gymnasium import spaces
from stable_baselines3 import DDPG, DQN, PPO
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.vec_env import VecEnv

from bridgegen.base.arrays import Float
from bridgegen.search.algorithms.observation import Observation, step_from

Arrays = dict[str, npt.NDArray[Any]]


@contextmanager
def own_generators(seed: Iterable[int]) -> Iterator[None]:
    """Seed torch's and NumPy's global generators, and restore their state afterwards.

    Stable-Baselines3 draws from both. Each batch has its own seed, so that no generator's state
    needs to be saved. One thread: sums are then in one order, and nets this small are no faster
    with more.
    """
    state = np.random.SeedSequence(list(seed)).generate_state(2, np.uint32)
    numpy_before = np.random.get_state()  # noqa: NPY002
    torch_before, threads = torch.get_rng_state(), torch.get_num_threads()
    try:
        np.random.seed(int(state[0]))  # noqa: NPY002
        # Stable-Baselines3 draws from torch's and NumPy's global generators. They are seeded for
        # each batch and put back afterwards, so that no generator's state has to be saved and other
        # code that draws from them has no effect.
        # Not manual_seed: it would seed every device.
        torch.default_generator.manual_seed(int(state[1]))
        # Sums over threads would depend on their number; a seed has one result.
        torch.set_num_threads(1)
        yield
    finally:
        torch.set_num_threads(threads)
        torch.set_rng_state(torch_before)
        np.random.set_state(numpy_before)  # noqa: NPY002


class Spaces(VecEnv):
    """Declares the number of environments and their spaces; it cannot be stepped.

    The campaign evaluates batches, so a model has no loop of its own: ``ask`` is its policy's
    forward pass, ``tell`` fills its buffer and calls its ``train``.
    """

    def __init__(self, n: int, n_obs: int, action: spaces.Space[Any]) -> None:
        self.num_envs, self.render_mode = n, None
        self.observation_space = spaces.Box(-1.0, 1.0, (n_obs,), np.float32)
        self.action_space = action

    def _unsupported(self, *args: Any, **given: Any) -> Any:
        raise NotImplementedError("only a campaign evaluates rows")

    reset = step_async = step_wait = close = _unsupported
    get_attr = set_attr = env_method = env_is_wrapped = _unsupported


def silent(model: Any) -> None:
    """Discard a model's log."""
    model.set_logger(Logger(None, []))


def arrays_of(policy: torch.nn.Module, optimizers: Iterable[torch.optim.Optimizer]) -> Arrays:
    """Return all arrays that training changes, as views: writing to them changes the model.

    Args:
        policy: with all its networks, the target ones included.
        optimizers: Adam optimisers of its parameters.
    """
    arrays = {f"net {name}": item.numpy() for name, item in policy.state_dict().items()}
    for i, optimizer in enumerate(optimizers):
        for j, group in enumerate(optimizer.param_groups):
            for k, parameter in enumerate(group["params"]):
                # As Adam initialises them at its first step.
                own: dict[str, torch.Tensor] = {
                    "step": torch.tensor(0.0),
                    "exp_avg": torch.zeros_like(parameter),
                    "exp_avg_sq": torch.zeros_like(parameter),
                }
                optimizer.state[parameter] = own
                arrays |= {
                    f"adam {i} {j} {k} {name}": tensor.numpy() for name, tensor in own.items()
                }
    return arrays


# --- Stable-Baselines3's DDPG and DQN as learners. Imported only when one is constructed ---


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


# --- Stable-Baselines3's PPO as a learner. Imported only when it is constructed ---


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
