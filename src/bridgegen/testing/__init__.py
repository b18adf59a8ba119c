"""Contracts of plug-ins: classes of pytest tests that their authors inherit.

    from bridgegen.testing import AlgorithmContract

    class TestMine(AlgorithmContract):
        algorithm = MyAlgorithm

BridgeGen's own algorithms, metrics, simulators and drivers keep the same contracts.
"""

try:
    import hypothesis  # noqa: F401
    import pytest
except ImportError as error:
    raise ImportError(
        f"bridgegen.testing needs {error.name}: pip install pytest hypothesis"
    ) from error

_CONTRACTS = ("algorithms", "drivers", "metrics", "simulators")
pytest.register_assert_rewrite(*(f"{__name__}.{name}" for name in _CONTRACTS))

from bridgegen.testing.algorithms import AlgorithmContract  # noqa: E402
from bridgegen.testing.drivers import DriverContract  # noqa: E402
from bridgegen.testing.metrics import MetricContract  # noqa: E402
from bridgegen.testing.scenes import make_rollout  # noqa: E402
from bridgegen.testing.simulators import SimulatorContract  # noqa: E402

__all__ = [
    "AlgorithmContract",
    "DriverContract",
    "MetricContract",
    "SimulatorContract",
    "make_rollout",
]
