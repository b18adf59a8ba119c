"""Base of the algorithms built on Stable-Baselines3. Imported only when one is constructed."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import numpy.typing as npt
import torch
from gymnasium import spaces
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.vec_env import VecEnv

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
        # Not manual_seed: it would seed every device.
        torch.default_generator.manual_seed(int(state[1]))
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
    arrays = {f"net {name}": one.numpy() for name, one in policy.state_dict().items()}
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
                arrays |= {f"adam {i} {j} {k} {name}": one.numpy() for name, one in own.items()}
    return arrays
