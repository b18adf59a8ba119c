"""An agent of one's own: the cross-entropy method over the vectorised environment.

    python docs/examples/my_agent.py crossroads-s2

Each step of the forty environments is one batch of the simulator. The agent draws rows from a
Gaussian, keeps the quarter that was rewarded most, and draws the next ones around it.
"""

import sys

import numpy as np

from bridgegen.search.algorithms.environment import ScenarioVectorEnv


def cross_entropy(environment: ScenarioVectorEnv, batches: int, seed: int = 0) -> list[float]:
    """Return the share of critical scenarios in each batch."""
    rng = np.random.default_rng(seed)
    n, n_var = environment.action_space.shape
    mean, std = np.zeros(n_var), np.full(n_var, 0.6)
    environment.reset(seed=seed)
    shares = []
    for _ in range(batches):
        actions = np.clip(rng.normal(mean, std, (n, n_var)), -1.0, 1.0).astype(np.float32)
        _, rewards, _, _, infos = environment.step(actions)
        best = actions[np.argsort(-rewards)[: n // 4]]
        mean, std = best.mean(axis=0), best.std(axis=0) + 0.05
        shares.append(float(infos["critical"].mean()))
    return shares


if __name__ == "__main__":
    # A row is an action, and no episode ends meanwhile.
    forty = ScenarioVectorEnv(sys.argv[1], ego="route-follower", action="row", horizon=1000)
    print(" ".join(f"{share:.2f}" for share in cross_entropy(forty, 15)))
