"""A policy of Stable-Baselines3 as a driver: untrained, as large as its default."""

import torch
from stable_baselines3.common.policies import ActorCriticPolicy

from bridgegen.drivers.policy import PolicyDriver


class Policy(PolicyDriver):
    def load(self):
        torch.set_num_threads(1)
        torch.manual_seed(0)
        return ActorCriticPolicy(*self.spaces(), lr_schedule=lambda _: 0.0)
