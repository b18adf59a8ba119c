"""PPO over all decisions of a batch of scenarios. Imported only when it is built."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import torch

from bridgegen.base.arrays import Bool, Float
from bridgegen.search.algorithms.algorithm import Arena
from bridgegen.search.rl.models import Arrays, arrays_of, model_of


class Duel:
    """A policy that decides for a participant, and its decisions in the present batch.

    Args:
        values: of the settings.
        arena: where it decides.
    """

    def __init__(self, values: Mapping[str, Any], arena: Arena) -> None:
        self._n_decisions, n_actions = arena.decisions.shape
        made = values["population"] * self._n_decisions
        self._model = model_of(
            values,
            arena.n_observed,
            n_actions,
            n_steps=self._n_decisions,
            minibatch=_even(made, values["minibatch"]),
        )
        self._steps: list[tuple[Any, ...]] = []
        self.arrays: Arrays = arrays_of(self._model.policy, [self._model.policy.optimizer])

    def begin(self) -> None:
        """Discard the decisions."""
        self._steps = []

    def act(self, observation: Float, running: Bool) -> Float:
        """Decide; see `Arena.play`."""
        kept = observation.astype(np.float32)
        with torch.no_grad():
            action, value, log_probability = self._model.policy(torch.from_numpy(kept))
        self._steps.append((kept, action.numpy(), value, log_probability, running.copy()))
        decided: Float = torch.special.ndtr(action.double()).numpy()
        return decided

    def learn(self, reward: npt.NDArray[np.float32]) -> None:
        """Learn from each scenario's final reward."""
        model, n = self._model, len(reward)
        buffer, alive = model.rollout_buffer, np.zeros((self._n_decisions, n), dtype=bool)
        alive[: len(self._steps)] = [running for *_, running in self._steps]
        after = np.vstack([alive[1:], np.zeros((1, n), dtype=bool)])
        buffer.reset()
        nothing = self._steps[-1][:4]
        for k in range(self._n_decisions):
            kept, action, value, log_probability = (
                self._steps[k][:4] if k < len(self._steps) else nothing
            )
            last = alive[k] & ~after[k]
            began = ~alive[k] | (k == 0)
            buffer.add(
                kept,
                action,
                np.where(last, reward, 0.0).astype(np.float32),
                began.astype(np.float32),
                value,
                log_probability,
            )
        buffer.compute_returns_and_advantage(last_values=torch.zeros(n), dones=np.ones(n))
        # Steps after a scenario's end hold no decisions: they are not trained on.
        buffer.advantages[~alive] = 0.0
        buffer.returns[~alive] = buffer.values[~alive]
        model.train()


def _even(total: int, most: int) -> int:
    """Return the largest divisor of a total from 2 to ``most``."""
    return max(
        (number for number in range(2, min(most, total) + 1) if total % number == 0), default=total
    )
