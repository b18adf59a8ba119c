"""Optuna's samplers as search algorithms (pip install optuna cmaes).

bridgegen benchmark algorithms crossroads-s4 --algorithms pso,docs/examples/optuna_search.py:TPE
"""

import warnings
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import ClassVar

import numpy as np
import optuna

from bridgegen.search.algorithms import Problem, Results, Setting
from bridgegen.search.algorithms.algorithm import resolve

optuna.logging.set_verbosity(optuna.logging.WARNING)


class Sampled(ABC):
    """What the samplers share: a study that is asked for rows and told their objective."""

    name: ClassVar[str]
    settings: ClassVar[Mapping[str, Setting]] = {
        "batch": Setting(1, "rows that are asked for before the first is told", 1, 10_000)
    }
    objectives: ClassVar[str] = "one"

    def __init__(self, problem: Problem, seed: int, **settings: bool | int | float | str) -> None:
        self.batch = resolve(type(self), problem, seed, settings)["batch"]
        self.ranges = {
            name: optuna.distributions.FloatDistribution(0.0, 1.0) for name in problem.parameters
        }
        with warnings.catch_warnings():  # options of Optuna that may change
            warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
            self.study = optuna.create_study(sampler=self.sampler(seed))
        self.asked: list[optuna.Trial] = []

    @abstractmethod
    def sampler(self, seed: int) -> optuna.samplers.BaseSampler:
        """Return Optuna's sampler."""

    def ask(self) -> np.ndarray:
        self.asked = [self.study.ask(self.ranges) for _ in range(self.batch)]
        return np.array([list(trial.params.values()) for trial in self.asked])

    def tell(self, U: np.ndarray, results: Results) -> None:
        for trial, F, ok in zip(self.asked, results.F[:, 0], results.ok, strict=True):
            if ok and np.isfinite(F):
                self.study.tell(trial, float(F))
            else:
                self.study.tell(trial, state=optuna.trial.TrialState.FAIL)


class TPE(Sampled):
    name = "optuna-tpe"
    description = "tree-structured Parzen estimator, all parameters together (Optuna)"
    source = "Bergstra et al. (2011), NeurIPS; Watanabe (2023), arXiv:2304.11127"

    def sampler(self, seed: int) -> optuna.samplers.BaseSampler:
        return optuna.samplers.TPESampler(
            seed=seed, multivariate=True, constant_liar=self.batch > 1
        )


class CMA(Sampled):
    name = "optuna-cma"
    description = "CMA-ES (Optuna, cmaes)"
    source = "Hansen (2016), arXiv:1604.00772; Nomura and Shibata (2024), arXiv:2402.01373"

    def sampler(self, seed: int) -> optuna.samplers.BaseSampler:
        return optuna.samplers.CmaEsSampler(seed=seed)
