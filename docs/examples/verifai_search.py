"""VerifAI's samplers as search algorithms (pip install verifai).

bridgegen benchmark algorithms cut-in --algorithms pso,docs/examples/verifai_search.py:CrossEntropy
"""

import random
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, ClassVar

import numpy as np
from verifai.features import Box, Feature, FeatureSpace
from verifai.samplers import FeatureSampler

from bridgegen.search.algorithms import Problem, Results, Setting
from bridgegen.search.algorithms.algorithm import resolve


class Sampled(ABC):
    """What the samplers share. They learn from whether a row is critical: ρ is −1, or else 1."""

    name: ClassVar[str]
    settings: ClassVar[Mapping[str, Setting]] = {
        "batch": Setting(1, "rows that are asked for before the first is told", 1, 10_000)
    }
    objectives: ClassVar[str] = "any"

    def __init__(self, problem: Problem, seed: int, **settings: bool | int | float | str) -> None:
        self.batch = resolve(type(self), problem, seed, settings)["batch"]
        self.rng = np.random.default_rng(seed)
        space = FeatureSpace({"row": Feature(Box(*[(0.0, 1.0)] * problem.n_var))})
        with self.seeded():
            self.sampler = self.make(space)
        self.asked: list[tuple[Any, Any]] = []

    @abstractmethod
    def make(self, space: FeatureSpace) -> Any:
        """Return VerifAI's sampler."""

    @contextmanager
    def seeded(self) -> Iterator[None]:
        """Seed the global generators, which VerifAI draws from, and put them back."""
        before, numpy_before = random.getstate(), np.random.get_state()
        seed = int(self.rng.integers(2**32))
        random.seed(seed)
        np.random.seed(seed)
        try:
            yield
        finally:
            random.setstate(before)
            np.random.set_state(numpy_before)

    def ask(self) -> np.ndarray:
        with self.seeded():
            self.asked = [self.sampler.getSample() for _ in range(self.batch)]
        rows = np.array([sample.row for sample, _ in self.asked], dtype=float)
        return np.clip(rows, 0.0, 1.0)

    def tell(self, U: np.ndarray, results: Results) -> None:
        with self.seeded():
            for (sample, info), critical in zip(self.asked, results.critical, strict=True):
                self.sampler.update(sample, info, -1.0 if critical else 1.0)


class CrossEntropy(Sampled):
    name = "verifai-ce"
    description = "cross-entropy over ten buckets of each parameter (VerifAI)"
    source = "Dreossi et al. (2019), doi:10.1007/978-3-030-25540-4_25"

    def make(self, space: FeatureSpace) -> Any:
        return FeatureSampler.crossEntropySamplerFor(space)


class Bandit(Sampled):
    name = "verifai-mab"
    description = "multi-armed bandit over buckets of each parameter (VerifAI)"
    source = "Viswanadha et al. (2021), doi:10.1007/978-3-030-88494-9_18"

    def make(self, space: FeatureSpace) -> Any:
        return FeatureSampler.multiArmedBanditSamplerFor(space)


class Halton(Sampled):
    name = "verifai-halton"
    description = "a Halton sequence (VerifAI)"
    source = "Halton (1960), doi:10.1007/BF01386213"

    def make(self, space: FeatureSpace) -> Any:
        return FeatureSampler.haltonSamplerFor(space)
