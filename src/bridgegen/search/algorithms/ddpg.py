"""Deep deterministic policy gradient, Stable-Baselines3's."""

from collections.abc import Mapping
from typing import ClassVar

from bridgegen.search.algorithms.algorithm import Setting
from bridgegen.search.rl.agent import ACTION, COMMON, MEMORY, STEP, Agent, Learner


class DDPG(Agent):
    """An actor that maximises a critic, which learns from a replay buffer.

    Noise is added to the actor's actions, for exploration; with ``action`` = row, the actor's −1
    and 1 are the ends of a parameter's range. Where the paper is silent: noise is Gaussian, not
    Lillicrap's correlated one; after each batch the networks are trained ``epochs`` times on as
    many transitions of the buffer as a batch has.

    Source: Lillicrap et al. (2016), "Continuous control with deep reinforcement learning"; Raffin
    et al. (2021), "Stable-Baselines3". Discount and learning rates: paper, Table IV.
    """

    name: ClassVar[str] = "ddpg"
    description: ClassVar[str] = "deep deterministic policy gradient (Stable-Baselines3; extra rl)"
    source: ClassVar[str] = "Lillicrap et al. (2016), arXiv:1509.02971"
    settings: ClassVar[Mapping[str, Setting]] = {
        **COMMON,
        "action": ACTION,
        "step": STEP,
        "epochs": Setting(32, "gradient steps after a batch", 1, 1000),
        "lr_actor": Setting(3e-4, "learning rate of the actor", 0.0, 1.0),
        "lr_critic": Setting(1e-3, "learning rate of the critic", 0.0, 1.0),
        "tau": Setting(0.005, "update rate of the target networks", 0.0, 1.0),
        "noise": Setting(
            0.5, "standard deviation of the noise; 1 is half an action's range", 0, 10
        ),
        "memory": MEMORY,
    }

    def _build(self, n_var: int, n_obs: int) -> Learner:
        from bridgegen.search.rl.off_policy import DDPGLearner

        return DDPGLearner(self._values, n_var, n_obs)
