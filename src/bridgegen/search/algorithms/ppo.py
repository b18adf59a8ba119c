"""Proximal policy optimisation, Stable-Baselines3's."""

from collections.abc import Mapping
from typing import ClassVar

from bridgegen.search.algorithms.algorithm import Setting
from bridgegen.search.rl.agent import ACTION, COMMON, STEP, Agent, Learner


class PPO(Agent):
    """A Gaussian policy that moves after every batch towards actions better than expected.

    An update uses one step of every environment, the paper's 25 iterations of 40. Where the
    paper is silent:

    - a step moves all parameters at once, by ``step`` times a Gaussian of standard deviation
      ``std``, which is learnt too, and is reflected at the faces of the cube;
    - with ``action`` = row, the policy's number a is the row's u = Φ(a), the normal distribution
      function: an untrained policy is then uniform random sampling;
    - the standard deviations have their own learning rate. At the actor's, they would hardly change
      in 25 iterations.

    Source: Schulman et al. (2017), "Proximal policy optimization algorithms"; Raffin et al.
    (2021), "Stable-Baselines3". Epochs, discount and learning rates: paper, Table IV.
    """

    name: ClassVar[str] = "ppo"
    description: ClassVar[str] = "proximal policy optimisation (Stable-Baselines3; extra rl)"
    source: ClassVar[str] = "Schulman et al. (2017), arXiv:1707.06347"
    settings: ClassVar[Mapping[str, Setting]] = {
        **COMMON,
        "action": ACTION,
        "step": STEP,
        "epochs": Setting(32, "passes over a batch, K_epochs", 1, 1000),
        "lr_actor": Setting(3e-4, "learning rate of the policy", 0.0, 1.0),
        "lr_critic": Setting(1e-3, "learning rate of the value function", 0.0, 1.0),
        "lr_std": Setting(3e-3, "learning rate of the standard deviations", 0.0, 1.0),
        "std": Setting(1.0, "initial standard deviation of the policy", 1e-3, 10.0),
        "clip": Setting(0.2, "how far an update may change an action's probability", 1e-3, 1.0),
        "entropy": Setting(0.0, "weight of the policy's entropy", 0.0, 1.0),
    }

    def _build(self, n_var: int, n_obs: int) -> Learner:
        from bridgegen.search.rl.on_policy import PPOLearner

        return PPOLearner(self._values, n_var, n_obs)
