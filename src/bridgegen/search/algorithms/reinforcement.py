"""Deep reinforcement learning by Stable-Baselines3: DQN, DDPG, PPO."""

from collections.abc import Mapping
from typing import ClassVar

from bridgegen.search.algorithms.algorithm import Setting
from bridgegen.search.rl.agent import ACTION, COMMON, MEMORY, STEP, Agent, Learner

# --- Deep Q-network, Stable-Baselines3's ---


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
        from bridgegen.search.rl.models import DQNLearner

        return DQNLearner(self._values, n_var, n_obs)


# --- Deep deterministic policy gradient, Stable-Baselines3's ---


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
        from bridgegen.search.rl.models import DDPGLearner

        return DDPGLearner(self._values, n_var, n_obs)


# --- Proximal policy optimisation, Stable-Baselines3's ---


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
        # At the actor's 3e-4, 25 updates leave the deviations where they began: R_critic with rows
        # 0.50 instead of 0.64 on S1, 0.51 instead of 0.60 on S4.
        "lr_std": Setting(3e-3, "learning rate of the standard deviations", 0.0, 1.0),
        "std": Setting(1.0, "initial standard deviation of the policy", 1e-3, 10.0),
        "clip": Setting(0.2, "how far an update may change an action's probability", 1e-3, 1.0),
        "entropy": Setting(0.0, "weight of the policy's entropy", 0.0, 1.0),
    }

    def _build(self, n_var: int, n_obs: int) -> Learner:
        from bridgegen.search.rl.models import PPOLearner

        return PPOLearner(self._values, n_var, n_obs)
