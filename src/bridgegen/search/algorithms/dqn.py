"""Deep Q-network, Stable-Baselines3's."""

from collections.abc import Mapping
from typing import ClassVar

from bridgegen.search.algorithms.algorithm import Setting
from bridgegen.search.rl.agent import COMMON, MEMORY, STEP, Agent, Learner


class DQN(Agent):
    """A network that predicts each action's value; the best action is taken, or a random one.

    Actions are discrete: 2·n_var of them, a step up or down in one parameter. The share of random
    ones falls from 1 in the first batch to ``epsilon``, by the same factor in each of ``explore``
    batches. Where the paper is silent: Q-networks have the critic's learning rate; after each
    batch the network is trained ``epochs`` times on as many transitions of the replay buffer as a
    batch has.

    Source: Mnih et al. (2015), "Human-level control through deep reinforcement learning"; Raffin
    et al. (2021), "Stable-Baselines3". Discount and learning rate: paper, Table IV.
    """

    name: ClassVar[str] = "dqn"
    description: ClassVar[str] = "deep Q-network over single steps (Stable-Baselines3; extra rl)"
    source: ClassVar[str] = "Mnih et al. (2015), doi:10.1038/nature14236"
    settings: ClassVar[Mapping[str, Setting]] = {
        **COMMON,
        "step": STEP,
        "epochs": Setting(32, "gradient steps after a batch", 1, 1000),
        "lr_critic": Setting(1e-3, "learning rate of the Q-network", 0.0, 1.0),
        "tau": Setting(0.1, "update rate of the target network", 0.0, 1.0),
        "epsilon": Setting(0.1, "final share of random actions", 1e-3, 1.0),
        "explore": Setting(10, "batches until that share is reached", 1, 1_000_000),
        "memory": MEMORY,
    }

    def _build(self, n_var: int, n_obs: int) -> Learner:
        from bridgegen.search.rl.off_policy import DQNLearner

        return DQNLearner(self._values, n_var, n_obs)
