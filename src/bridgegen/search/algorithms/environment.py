"""The search as Gymnasium environments, for agents of one's own. Needs the extra ``rl``.

    from bridgegen.search.algorithms.environment import ScenarioEnv, ScenarioVectorEnv

    environment = ScenarioEnv("crossroads-s1", ego="route-follower")
    forty = ScenarioVectorEnv("crossroads-s1", ego="route-follower")   # one batch each step

`bridgegen.search.algorithms.environment_sb3` has the vectorised one as Stable-Baselines3 wants it.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import InputError
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load
from bridgegen.search.algorithms.algorithm import Problem
from bridgegen.search.algorithms.observation import (
    ENCODINGS,
    Encoding,
    Observation,
    Observer,
    step_from,
)

Action = npt.NDArray[np.float32]


class Episodes:
    """n episodes over one pipeline; what the environments have in common.

    - **Observation**: ``(n_var + metrics,)`` float32 in [−1, 1], the row that was evaluated last
      and its metrics; see `Observer`.
    - **Action**: ``(n_var,)`` float32 in [−1, 1]. "step": the next row is the last one plus
      ``step`` times the action, reflected at the faces of the unit cube. "row": the next row is
      (action + 1)/2.
    - **Reward**: −F of the row, the scenario's objective, larger is more critical, not scaled. A
      failed simulation is rewarded as F of all metrics at their caps: none is worse.
    - **Terminated**: once the row is critical, if the episode is to end there (``until_critical``);
      otherwise never, for harm is no end of a search.
    - **Truncated**: after ``horizon`` steps.
    - **Info**: "row" ``(n_var,)``, "critical", "failed", "metrics" ``(metrics,)`` in their units.
    - An episode starts at a random row, which is evaluated, too, or at ``options["row"]``.

    Args:
        scenario: a name of the catalogue, the path of a YAML file, or a pipeline with an objective.
        n: environments.
        ego: the driver; the scenario's choice by default.
        action: "step" or "row".
        step: how far a step goes at most in each parameter, as a share of its range.
        horizon: steps of an episode.
        until_critical: whether an episode ends at a critical row.

    Raises:
        InputError: a value breaks a rule; as `Pipeline` says, besides.
    """

    def __init__(
        self,
        scenario: str | Path | Pipeline,
        n: int,
        *,
        ego: str | None = None,
        action: Encoding = "step",
        step: float = 0.2,
        horizon: int = 25,
        until_critical: bool = False,
    ) -> None:
        problems = [
            f"{name} must be {wanted}, got {value!r}"
            for name, value, wanted, holds in (
                ("num_envs", n, "≥ 1", n >= 1),
                ("action", action, f"one of {', '.join(ENCODINGS)}", action in ENCODINGS),
                ("step", step, "in 0 .. 1, and not 0", 0.0 < step <= 1.0),
                ("horizon", horizon, "≥ 1", horizon >= 1),
            )
            if not holds
        ]
        if isinstance(scenario, Pipeline):
            if ego is not None:
                problems.append(f"a pipeline has its driver, it takes no other, got {ego!r}")
            self.pipeline = scenario
        if problems:
            raise InputError(*problems)
        if not isinstance(scenario, Pipeline):
            logical = load(scenario)
            self.pipeline = Pipeline(logical, logical.space(), PipelineOptions(ego=ego))
            self.pipeline.choose_objective(objectives="one")
        space, objective = self.pipeline.space, self.pipeline.objective
        if objective.n_obj != 1 or space.n_var == 0:
            raise InputError("an environment needs a single objective and something that varies")
        self._observe = Observer(Problem(tuple(space.variables), self.pipeline.metrics))
        self._encoding, self._step, self._horizon = action, step, horizon
        self._until_critical = until_critical
        self.n, self.n_var = n, space.n_var
        self.observation_space = spaces.Box(-1.0, 1.0, (self._observe.size,), np.float32)
        self.action_space = spaces.Box(-1.0, 1.0, (self.n_var,), np.float32)
        self._U = np.full((n, self.n_var), 0.5)
        self._age = np.zeros(n, np.int64)

    def next_rows(self, actions: npt.ArrayLike) -> Float:
        """Return the rows that actions lead to, ``(n, n_var)``.

        Raises:
            ValueError: actions are not ``(n, n_var)`` finite numbers.
        """
        moves = np.asarray(actions, np.float64)
        if moves.shape != self._U.shape or not np.isfinite(moves).all():
            raise ValueError(f"actions must be {self._U.shape} finite numbers, got {moves.shape}")
        moves = np.clip(moves, -1.0, 1.0)
        if self._encoding == "row":
            rows: Float = (moves + 1.0) / 2.0
            return rows
        return step_from(self._U, self._step * moves)

    def first_row(self, rng: np.random.Generator, options: dict[str, Any] | None) -> Float:
        """Return where an episode starts, ``(n_var,)``.

        Raises:
            InputError: an option that is unknown, or no row of the unit cube.
        """
        given = dict(options or {})
        row = given.pop("row", None)
        if given:
            raise InputError(f"unknown options: {', '.join(map(str, given))}; there is: row")
        if row is None:
            return rng.random(self.n_var)
        there = np.asarray(row, np.float64)
        if there.shape != (self.n_var,) or not ((there >= 0.0) & (there <= 1.0)).all():
            raise InputError(f"options: row must be {self.n_var} numbers in 0 .. 1, got {row!r}")
        return there

    def move(
        self, U: Float, begin: Bool
    ) -> tuple[Observation, Float, Bool, Bool, dict[str, npt.NDArray[Any]]]:
        """Evaluate the next rows, one batch; those that ``begin`` an episode are no steps.

        Returns:
            Observations, rewards, terminated, truncated and infos, n of each.
        """
        result = self.pipeline.evaluate(self.pipeline.space.decode(U))
        self._U = U
        self._age = np.where(begin, 0, self._age + 1)
        failed = result.status != 0
        infos = {
            "row": U.copy(),
            "critical": result.critical,
            "failed": failed,
            "metrics": result.metrics,
        }
        terminated = result.critical & ~begin & self._until_critical
        truncated = (self._age >= self._horizon) & ~terminated
        reward = np.where(begin, 0.0, -result.F[:, 0])
        return self._observe(U, result.metrics), reward, terminated, truncated, infos

    def begin(self, U: Float, begin: Bool) -> Observation:
        """Return what is observed at the first rows of new episodes; the others stay as they are.

        Args:
            U: ``(n, n_var)``; only rows that ``begin`` are evaluated.
            begin: ``(n,)``.
        """
        metrics = np.full((self.n, len(self.pipeline.metrics)), np.nan)
        metrics[begin] = self.pipeline.evaluate(self.pipeline.space.decode(U[begin])).metrics
        self._U = np.where(begin[:, np.newaxis], U, self._U)
        self._age = np.where(begin, 0, self._age)
        return self._observe(U, metrics)

    def of(self, infos: dict[str, npt.NDArray[Any]], k: int) -> dict[str, Any]:
        """Return the info of one environment."""
        return {
            "row": infos["row"][k],
            "critical": bool(infos["critical"][k]),
            "failed": bool(infos["failed"][k]),
            "metrics": infos["metrics"][k],
        }


class ScenarioEnv(gymnasium.Env[Observation, Action]):
    """One environment: each step evaluates one row. See `Episodes` for all that it means."""

    metadata: ClassVar[dict[str, Any]] = {"render_modes": []}  # type: ignore[misc]

    def __init__(self, scenario: str | Path | Pipeline, **settings: Any) -> None:
        self._episodes = Episodes(scenario, 1, **settings)
        self.pipeline = self._episodes.pipeline
        self.observation_space = self._episodes.observation_space
        self.action_space = self._episodes.action_space

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode at a random row, or at ``options["row"]``."""
        super().reset(seed=seed)
        U = self._episodes.first_row(self.np_random, options)[np.newaxis]
        observations, _, _, _, infos = self._episodes.move(U, np.ones(1, np.bool_))
        return observations[0], self._episodes.of(infos, 0)

    def step(self, action: Action) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Evaluate the row that the action leads to."""
        U = self._episodes.next_rows(np.asarray(action)[np.newaxis])
        moved = self._episodes.move(U, np.zeros(1, np.bool_))
        observations, rewards, terminated, truncated, infos = moved
        info = self._episodes.of(infos, 0)
        return observations[0], float(rewards[0]), bool(terminated[0]), bool(truncated[0]), info


class ScenarioVectorEnv(VectorEnv[Observation, Action, npt.NDArray[Any]]):
    """Forty environments, or as many as are wanted: each step evaluates one batch.

    An episode that has ended begins anew with the next step (Gymnasium's next-step autoreset),
    whatever its action is, in the same batch, with reward 0. The environments are those that
    `ScenarioEnv` would be with the seeds seed, seed + 1 … Infos are arrays, a row for each.
    """

    metadata: ClassVar[dict[str, Any]] = {  # type: ignore[misc]
        "render_modes": [],
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self, scenario: str | Path | Pipeline, num_envs: int = 40, **settings: Any
    ) -> None:
        self._episodes = Episodes(scenario, num_envs, **settings)
        self.pipeline, self.num_envs = self._episodes.pipeline, num_envs
        self.single_observation_space = self._episodes.observation_space
        self.single_action_space = self._episodes.action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._generators = generators(None, num_envs)
        self._ended = np.zeros(num_envs, np.bool_)

    def reset(
        self, *, seed: int | Sequence[int] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start all episodes at random rows, or at ``options["row"]``."""
        if seed is not None:
            self._generators = generators(seed, self.num_envs)
        rows = [self._episodes.first_row(rng, options) for rng in self._generators]
        self._ended = np.zeros(self.num_envs, np.bool_)
        observations, _, _, _, infos = self._episodes.move(np.stack(rows), ~self._ended)
        return observations, dict(infos)

    def step(
        self, actions: Action
    ) -> tuple[Observation, npt.NDArray[Any], npt.NDArray[Any], npt.NDArray[Any], dict[str, Any]]:
        """Evaluate the rows that the actions lead to, and the first ones of new episodes."""
        U, begin = self._episodes.next_rows(actions), self._ended
        for k in np.flatnonzero(begin).tolist():
            # Each environment draws from its own generator: its episodes do not depend on the
            # others'.
            U[k] = self._episodes.first_row(self._generators[k], None)
        moved = self._episodes.move(U, begin)
        observations, rewards, terminated, truncated, infos = moved
        self._ended = terminated | truncated
        return observations, rewards, terminated, truncated, dict(infos)


def generators(seed: int | Sequence[int] | None, n: int) -> list[np.random.Generator]:
    """Return a generator for each environment, seeded as Gymnasium seeds them.

    Raises:
        InputError: not as many seeds as environments.
    """
    seeds: Sequence[int | None]
    if seed is None:
        seeds = [None] * n
    else:
        seeds = [seed + k for k in range(n)] if isinstance(seed, int) else list(seed)
    if len(seeds) != n:
        raise InputError(f"a seed for each of {n} environments is needed, got {len(seeds)}")
    return [seeding.np_random(number)[0] for number in seeds]
