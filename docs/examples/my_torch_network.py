"""The same driver in PyTorch. Untrained: load weights of your own."""

import torch

from bridgegen.drivers.batches import FixedBatch
from bridgegen.drivers.policy import SIZE, control, vectors


class MyTorchNetwork:
    def __init__(self):
        torch.set_num_threads(1)  # small networks are faster so
        torch.manual_seed(0)
        self._net = torch.nn.Sequential(
            torch.nn.Linear(SIZE, 64), torch.nn.Tanh(), torch.nn.Linear(64, 2), torch.nn.Tanh()
        ).eval()  # load_state_dict(torch.load("my_weights.pt"))
        self._network = FixedBatch(self._layers)

    def reset(self, n, scene):
        self._scene = scene

    def act(self, observation):
        return control(self._network(vectors(observation)), self._scene)

    @torch.inference_mode()
    def _layers(self, seen):  # (64, SIZE) -> (64, 2), NumPy to NumPy
        return self._net(torch.from_numpy(seen)).numpy()
