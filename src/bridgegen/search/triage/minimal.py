"""Minimal scenarios: all parameters as close to nominal as the failure mode permits.

Each searched parameter of a harmful row has a ladder of values from its own to nominal, in steps of
2.5 % of its range. A parameter may jump down its ladder by all remaining steps, a half, a quarter,
an eighth, or one step, if the scenario then still fails in the same mode; the single jumps of all
parameters of all modes are tried in one batch, then combinations of the permitted ones. When no
jump is left, the parameters that are not nominal move back by the fewest steps that make the
scenario robust. If no such move does, the descent starts again with jumps by all steps or a half,
each of which must leave half of the neighbours harmful. What the scenario then needs of each
parameter is stated as far as probes confirm it, see `bridgegen.search.triage.conditions`. All
scenarios use the random numbers of the original row, so that the limits are limits of parameters
only.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.trials import Trials
from bridgegen.scenario.language.space import SearchSpace
from bridgegen.search.triage.conditions import Conditions, sentence
from bridgegen.search.triage.effort import FULL, Effort
from bridgegen.search.triage.modes import Key, keys_of
from bridgegen.search.triage.moves import around, nearest, ranges, searched
from bridgegen.search.triage.neighbours import NEIGHBOURS, RADIUS, ROBUST
from bridgegen.search.triage.record import Minimal

BACK = (0, 1, 2, 4, 8)
"""Steps by which the parameters that are not nominal move back to make the scenario robust."""

SHARES, MOST_ROUNDS = (1, 2, 4, 8, 10_000_000), 40
"""Jumps: by all remaining steps of a ladder, a half, …, one step; maximum number of rounds."""

ROBUST_SHARES, MOST_ROBUST_ROUNDS = (1, 2), 6
"""Jumps and maximum number of rounds if each jump must leave the scenario robust."""

Holds = Callable[[Sequence["Ladder"], Sequence[Key], Sequence[Int]], list[Bool]]
"""Function that evaluates where harm persists, given ladders and keys of modes, and rungs ``(n,
n_var)`` of each."""


@dataclass(frozen=True, eq=False)
class Ladder:
    """The values of each searched parameter from a row's to nominal.

    Attributes:
        start: ``(n_var,)``.
        nominal: ``(n_var,)``.
        step: ``(n_var,)`` > 0; at least 1 of a whole number, the range of a category.
        rungs: ``(n_var,)`` int64, steps from start to nominal; the last may be shorter.
    """

    start: Float
    nominal: Float
    step: Float
    rungs: Int

    @classmethod
    def of(cls, space: SearchSpace, x: Float) -> "Ladder":
        """Return the ladder of a row of X."""
        chosen = [space.parameters[name] for name in space.variables]
        step = np.array(
            [parameter.kind.step(parameter.low, parameter.high, RADIUS) for parameter in chosen]
        )
        start = searched(space, x[np.newaxis])[0]
        nominal = searched(space, space.row({})[np.newaxis])[0]
        rungs = np.ceil(np.abs(nominal - start) / step - 1e-9).astype(np.int64)
        return cls(start, nominal, step, rungs)

    def values(self, at: Int) -> Float:
        """Return the wanted values at rungs ``(…, n_var)``."""
        way = np.sign(self.nominal - self.start)
        return np.where(at >= self.rungs, self.nominal, self.start + way * at * self.step)


class Minimiser:
    """Finds the minimal scenarios of modes, all at once.

    Args:
        pipeline: the run's, one that ``tries``.
        seed: of the run.
        effort: of the triage.
    """

    def __init__(self, pipeline: Pipeline, seed: int, effort: Effort = FULL) -> None:
        self._effort = effort
        self._pipeline, self._space, self._seed = pipeline, pipeline.space, seed
        self._bases: Float = np.empty((0, len(pipeline.space.names)))

    def find(self, X: Float, ways: Sequence[Key], names: Sequence[str]) -> list[Minimal | None]:
        """Return the minimal scenario of each mode; None if its row now fails in another mode.

        Args:
            X: ``(K, len(space.names))``, a row of each mode.
            ways: ``(K,)`` keys of the modes, without causes.
            names: ``(K,)`` of their files.
        """
        space = self._space
        ladders = [Ladder.of(space, x) for x in X]
        self._bases = X
        here = [np.zeros(space.n_var, dtype=np.int64) for _ in X]
        alive = self._holds(ladders, ways, [at[np.newaxis] for at in here])
        modes = [m for m in range(len(X)) if alive[m][0]]
        self._descend(ladders, ways, here, modes, SHARES, MOST_ROUNDS, self._holds)
        # The minimal scenario lies at the edge of the harm, where half of its neighbours may be
        # harmless.
        frail = self._move_back(ladders, ways, here, modes)
        if not self._effort.descends_robustly:
            frail = []
        start = [np.zeros((int(m in frail), space.n_var), dtype=np.int64) for m in range(len(X))]
        robust = self._holds_robustly(ladders, ways, start)
        frail = [m for m in frail if robust[m][0]]
        for m in frail:  # again, with jumps that keep it robust: they cost more, so they are fewer
            here[m] = start[m][0]
        self._descend(
            ladders, ways, here, frail, ROBUST_SHARES, MOST_ROBUST_ROUNDS, self._holds_robustly
        )
        self._put_to_nominal(ladders, ways, here, modes)
        return self._described(ladders, here, modes, names)

    def _descend(
        self,
        ladders: Sequence[Ladder],
        ways: Sequence[Key],
        here: list[Int],
        modes: Sequence[int],
        shares: Sequence[int],
        rounds: int,
        holds: Holds,
    ) -> None:
        """Move the modes' parameters towards nominal until no jump is left.

        Args:
            ladders: of all modes.
            ways: keys of all modes.
            here: the rung of each parameter of each mode; changed.
            modes: those to move.
            shares: a parameter may jump by the remaining steps divided by one of these.
            rounds: maximum number.
            holds: returns where the harm persists.
        """
        active = list(modes)
        for _ in range(rounds):
            if not active:
                return
            jumps: list[list[tuple[int, int]]] = [[] for _ in ladders]
            tried: list[Int] = [np.empty((0, self._space.n_var), np.int64) for _ in ladders]
            for m in active:
                left = ladders[m].rungs - here[m]
                for i in np.flatnonzero(left).tolist():
                    sizes = {max(1, int(left[i]) // share) for share in shares}
                    jumps[m] += [(i, size) for size in sorted(sizes, reverse=True)]
                tried[m] = np.array([_jumped(here[m], [jump]) for jump in jumps[m]], dtype=np.int64)
                tried[m] = tried[m].reshape(len(jumps[m]), self._space.n_var)
            alone = holds(ladders, ways, tried)
            allowed: dict[int, list[tuple[int, int]]] = {}
            for m in active:
                best: dict[int, int] = {}
                for (i, size), fine in zip(jumps[m], alone[m].tolist(), strict=True):
                    if fine:
                        best.setdefault(i, size)  # jumps are sorted, the largest first
                if best:
                    reach = ladders[m].step / ranges(self._space)
                    order = sorted(best, key=lambda i: (-best[i] * reach[i], i))
                    allowed[m] = [(i, best[i]) for i in order]
            together: list[Int] = [np.empty((0, self._space.n_var), np.int64) for _ in ladders]
            for m, moves in allowed.items():
                prefixes = [_jumped(here[m], moves[:k]) for k in range(1, len(moves) + 1)]
                together[m] = np.array(prefixes, dtype=np.int64)
            fine = holds(ladders, ways, together)
            for m in allowed:
                fine[m][0] = True  # known from above
                here[m] = together[m][int(np.flatnonzero(fine[m])[-1])]
            active = list(allowed)

    def _move_back(
        self, ladders: Sequence[Ladder], ways: Sequence[Key], here: list[Int], modes: Sequence[int]
    ) -> list[int]:
        """Move parameters that are not nominal back until a mode is robust; return the others."""
        tried: list[Int] = [np.empty((0, self._space.n_var), np.int64) for _ in ladders]
        for m in modes:
            bound = here[m] < ladders[m].rungs
            tried[m] = np.array(
                [np.where(bound, np.maximum(here[m] - b, 0), here[m]) for b in BACK]
            )
        fine = self._holds(ladders, ways, tried)
        frail, best = list(modes), dict.fromkeys(modes, -1.0)
        # All five steps at once gave the same result with 160 instead of 66 simulations a mode.
        for k in range(len(BACK)):  # one after the other: most modes are robust soon
            asked = [m for m in frail if fine[m][k]]
            shares = self._robustness([(m, tried[m][k]) for m in asked], ladders)
            for m, (share, _, _) in zip(asked, shares, strict=True):
                if fine[m][k] and share > best[m]:
                    best[m], here[m] = share, tried[m][k]
            frail = [m for m in frail if best[m] < ROBUST]
        return frail

    def _put_to_nominal(
        self, ladders: Sequence[Ladder], ways: Sequence[Key], here: list[Int], modes: Sequence[int]
    ) -> None:
        """Put parameters to nominal of which nothing is needed after all, one after the other."""
        active = list(modes)
        while active:
            needed = {m: _needed(ladders[m], here[m]) for m in active}
            tried: list[Int] = [np.empty((0, self._space.n_var), np.int64) for _ in ladders]
            for m, each in needed.items():
                rows = [_put(here[m], i, int(ladders[m].rungs[i])) for i in each]
                tried[m] = np.array(rows, dtype=np.int64).reshape(len(rows), self._space.n_var)
            fine = self._holds(ladders, ways, tried)
            active = [m for m in active if fine[m].any()]
            for m in active:
                here[m] = tried[m][int(np.argmax(fine[m]))]

    def _described(
        self,
        ladders: Sequence[Ladder],
        here: Sequence[Int],
        modes: Sequence[int],
        names: Sequence[str],
    ) -> list[Minimal | None]:
        space, found = self._space, list[Minimal | None]([None] * len(ladders))
        if not modes:
            return found
        X = np.concatenate([self._rows(ladders[m], here[m][np.newaxis]) for m in modes])
        shares = self._robustness([(m, here[m]) for m in modes], ladders)
        tried = self._pipeline.try_all(X, noise=self._bases[list(modes)])
        noise = self._pipeline.runner.noise_keys(self._bases[list(modes)])
        for k, m in enumerate(modes):
            if not tried.harmful[k]:
                continue
            conditions, inside, rest = Conditions(
                self._pipeline,
                X[k],
                self._bases[m],
                ladders[m].step,
                int(noise[k]),
                self._seed,
                self._effort.probes,
            ).find(_needed(ladders[m], here[m]))
            width = dict(zip(space.variables, ranges(space).tolist(), strict=True))
            conditions.sort(
                key=lambda condition: (
                    -abs(condition.value - condition.nominal) / width[condition.name],
                    condition.name,
                )
            )
            share, hits, rows = shares[k]
            found[m] = Minimal(
                name=names[m],
                x=tuple(X[k].tolist()),
                noise_key=str(noise[k]),
                values=self._pipeline.runner.facts(X[k]),
                conditions=tuple(conditions),
                sentence=sentence(conditions, rest, draws=self._pipeline.draws),
                rows=rows,
                harmful=hits,
                robustness=share if rows else None,
                harm=float(tried.harm[k]),
                severity=float(tried.severity[k]),
                inside=inside,
            )
        return found

    def _rows(self, ladder: Ladder, at: Int) -> Float:
        return nearest(self._space, ladder.values(at))

    def _holds(
        self, ladders: Sequence[Ladder], ways: Sequence[Key], tried: Sequence[Int]
    ) -> list[Bool]:
        """Return, per mode, at which rungs ``(n, n_var)`` its harm persists."""
        parts = [self._rows(ladder, at) for ladder, at in zip(ladders, tried, strict=True)]
        # The noise of the row that is minimised, in every trial: it is a function of the row, and
        # would else change with each step.
        noise = np.repeat(self._bases, [len(part) for part in parts], axis=0)
        trials = self._pipeline.try_all(np.concatenate(parts), noise=noise)
        keys = keys_of(
            trials.findings, self._pipeline.runner.kinds, trials.place.tolist(), [""] * len(trials)
        )
        fine, start = [], 0
        for part, way in zip(parts, ways, strict=True):
            stop = start + len(part)
            same = np.array([key == way for key in keys[start:stop]], dtype=np.bool_)
            fine.append(trials.harmful[start:stop] & same)
            start = stop
        return fine

    def _holds_robustly(
        self, ladders: Sequence[Ladder], ways: Sequence[Key], tried: Sequence[Int]
    ) -> list[Bool]:
        """Return where the harm persists in the row and in half of its neighbours."""
        fine = self._holds(ladders, ways, tried)
        asked = [(m, int(k)) for m, each in enumerate(fine) for k in np.flatnonzero(each)]
        shares = self._robustness([(m, tried[m][k]) for m, k in asked], ladders)
        for (m, k), (share, _, _) in zip(asked, shares, strict=True):
            fine[m][k] = share >= ROBUST
        return fine

    def _robustness(
        self, asked: Sequence[tuple[int, Int]], ladders: Sequence[Ladder]
    ) -> list[tuple[float, int, int]]:
        """Return the harmful share of the neighbours of rungs, how many, of how many."""
        if not asked:
            return []
        bases = np.concatenate([self._rows(ladders[m], at[np.newaxis]) for m, at in asked])
        space = self._space
        rows = [around(space, x, self._seed, 0, NEIGHBOURS, RADIUS)[0] for x in bases]
        noise = np.repeat(self._bases[[m for m, _ in asked]], NEIGHBOURS, axis=0)
        trials: Trials = self._pipeline.try_all(np.concatenate(rows), noise=noise)
        ok = trials.ok.reshape(-1, NEIGHBOURS).sum(axis=1)
        hits = trials.harmful.reshape(-1, NEIGHBOURS).sum(axis=1)
        return [(int(h) / max(int(n), 1), int(h), int(n)) for h, n in zip(hits, ok, strict=True)]


def _needed(ladder: Ladder, at: Int) -> list[int]:
    return np.flatnonzero(at < ladder.rungs).tolist()


def _jumped(at: Int, jumps: Sequence[tuple[int, int]]) -> Int:
    there = at.copy()
    for i, size in jumps:
        there[i] += size
    return there


def _put(at: Int, i: int, rung: int) -> Int:
    there = at.copy()
    there[i] = rung
    return there
