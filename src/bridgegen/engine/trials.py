"""Rows that are simulated again, changed or not, to test whether harm persists."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import numpy.typing as npt

from bridgegen.assess.conflict import quantities
from bridgegen.assess.conflict.analysis import NO_CONFLICT, VIOLATION, Conflicts, analyse
from bridgegen.assess.conflict.findings import KINDS, Findings
from bridgegen.assess.conflict.harm import NEAR_MISS, Count, decisive
from bridgegen.assess.conflict.place import place_on_route
from bridgegen.assess.conflict.plausibility import plausibility
from bridgegen.base import elementary
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.engine.runner import Runner
from bridgegen.simulation.embedded.places.network import Network
from bridgegen.simulation.rollout import Rollout

MEASURES = ("time", "x", "y", "v_ego", "v_other", "closing_normal", "closing_tangential", "ttc")
CODES = ("kind", "type", "zone_ego", "zone_other", "partner")
EVENT = (*MEASURES, *CODES)
"""The columns of ``Trials.event``: numbers in s, m, m/s and s; then codes of `Conflicts`."""


@dataclass(frozen=True)
class Trials:
    """The results of N rows that are simulated to test whether harm persists.

    Attributes:
        harm: ``(N,)`` float64, 0 where there is no result.
        severity: ``(N,)`` float64, probability of MAIS3+ in the ego's collision.
        ok: ``(N,)`` bool, the simulation succeeded and its traffic is plausible.
        findings: the decisive conflict of each row.
        place: ``(N,)`` texts, the place of the ego's front on its route at that conflict; see
            `bridgegen.assess.conflict.place`.
        event: ``(N, len(EVENT))`` float64, what happened in that conflict: when, where the ego's
            front was, speeds, which parts of whom met; 0 where there is none.
        preventable: ``(N,)`` bool, the careful driver of UN R157 would have avoided it by braking.
        harmless_until: ``(N,)`` float64 [s], up to when a row is known to be harmless: the time of
            the conflict of a harmful one; of a harmless one infinity, or the first implausible
            motion; −inf where it is not known.
    """

    harm: Float
    severity: Float
    ok: Bool
    findings: Findings
    place: npt.NDArray[np.object_]
    event: Float
    preventable: Bool
    harmless_until: Float

    def __len__(self) -> int:
        return len(self.harm)

    @property
    def harmful(self) -> Bool:
        """``(N,)`` bool: a collision, near miss or violation of the ego's."""
        harmful: Bool = self.ok & (self.harm >= NEAR_MISS)
        return harmful

    @property
    def avoidable(self) -> list[bool | None]:
        """``preventable`` of N rows; None of a violation, of which it is not asked."""
        pairs = zip(self.preventable.tolist(), self.findings.conflict, strict=True)
        return [None if conflict == KINDS[VIOLATION] else pair for pair, conflict in pairs]

    @classmethod
    def of(cls, rollout: Rollout, roads: Network, which: Int, harm: str, count: Count) -> "Trials":
        """Return the results of a rollout.

        Args:
            rollout: of N rows.
            roads: compiled.
            which: ``(N,)``, the road network of each row.
            harm: the quantity that counts, "harm" or "harm_any".
            count: whose conflicts count.
        """
        n = rollout.shape[0]
        conflicts = analyse(rollout)
        values = quantities.evaluate(rollout, [harm, "severity"])
        gate = plausibility(rollout)
        findings = Findings.of(conflicts, gate.labels, count)
        ok: Bool = (rollout.status == 0) & (findings.implausible == "")
        # Only of rows that count: a place is looked for on the route in Python.
        place = np.full(n, "", dtype=object)
        rows = np.arange(n)
        other = decisive(conflicts, count)[0]
        instant, vehicle = conflicts.instant[rows, other], conflicts.parties(rows, other)[0]
        front = rollout.box[vehicle, 2] + 0.5 * rollout.box[vehicle, 0]
        h = rollout.h[rows, vehicle, instant]
        x = rollout.x[rows, vehicle, instant] + front * elementary.cos(h)
        y = rollout.y[rows, vehicle, instant] + front * elementary.sin(h)
        wanted = ok & np.isin(findings.conflict, list(KINDS.values()))
        networks = {0: roads, **dict(zip(conflicts.driven, roads.partners, strict=True))}
        for (e, there), p in product(networks.items(), np.unique(which[wanted]).tolist()):
            at = np.flatnonzero(wanted & (which == p) & (vehicle == e))
            step = float(there.tables.steps[p, 0])
            way, junctions = there.way(p, 0), there.in_junctions(p)
            place[at] = place_on_route(way, step, junctions, x[at], y[at])
            if e:  # so that modes say whose they are
                said = f"on the route of {rollout.names[e]}, "
                place[at] = [f"{said}{text}".rstrip(", ") for text in place[at]]
        worth, severity = (np.where(ok, values[:, k], 0.0) for k in range(2))
        bad = values[:, 0] >= NEAR_MISS
        until = np.where(bad, instant, np.where(gate.instant < 0, np.inf, gate.instant))
        until = np.where((rollout.status != 0) | (bad & ~ok), -np.inf, until * rollout.time_step)
        event = _event(conflicts, other, x, y)
        return cls(
            worth, severity, ok, findings, place, event, conflicts.preventable[rows, other], until
        )

    @classmethod
    def none(cls, n: int) -> "Trials":
        """Return N rows without a result."""
        nothing, no = np.zeros(n), np.zeros(n, np.bool_)
        texts, event = np.full(n, "", dtype=object), np.zeros((n, len(EVENT)))
        unknown = np.full(n, -np.inf)
        return cls(nothing, nothing, no, Findings.none(n), texts, event, no, unknown)

    @classmethod
    def join(cls, parts: Sequence["Trials"]) -> "Trials":
        """Return those of several parts, at least one, in their order."""
        return cls(
            np.concatenate([part.harm for part in parts]),
            np.concatenate([part.severity for part in parts]),
            np.concatenate([part.ok for part in parts]),
            Findings.join([part.findings for part in parts]),
            np.concatenate([part.place for part in parts]),
            np.concatenate([part.event for part in parts]),
            np.concatenate([part.preventable for part in parts]),
            np.concatenate([part.harmless_until for part in parts]),
        )

    def take(self, at: Int | Bool) -> "Trials":
        """Return those of some rows."""
        return Trials(
            self.harm[at],
            self.severity[at],
            self.ok[at],
            self.findings.take(at),
            self.place[at],
            self.event[at],
            self.preventable[at],
            self.harmless_until[at],
        )


def _event(conflicts: Conflicts, other: Int, x: Float, y: Float) -> Float:
    """Return what happened in the conflicts with some participants; see ``Trials.event``."""
    rows = np.arange(len(other))
    codes = [getattr(conflicts, name)[rows, other] for name in CODES[:-1]]
    measures = [getattr(conflicts, name)[rows, other] for name in MEASURES[3:]]
    time = conflicts.instant[rows, other] * conflicts.time_step
    found = np.stack([time, x, y, *measures, *codes, other], axis=1)
    return np.where((codes[0] == NO_CONFLICT)[:, np.newaxis], 0.0, np.nan_to_num(found))


def try_rows(runner: Runner, rows: Float, harm: str, count: Count) -> Trials:
    """Simulate N rows at once, in this thread.

    Args:
        runner: runs them, in the embedded simulator.
        rows: ``(N, 2 n + 1)``: X, the rows whose random numbers they use, number of the fix in
            ``runner.fixes``, −1 for none.
        harm: the quantity that is measured.
        count: the conflicts that count.
    """
    parts = [(at, _try(item, rows[at], harm, count)) for at, item in runner.by_variant(rows)]
    return Trials.join([part for _, part in parts]).take(
        np.argsort(np.concatenate([at for at, _ in parts]))
    )


def _try(runner: Runner, rows: Float, harm: str, count: Count) -> Trials:
    """Simulate N rows of one storyboard; see `try_rows`."""
    n = len(runner.space.names)
    X, keys, numbers = rows[:, :n], rows[:, n : 2 * n], rows[:, -1].astype(np.int64)
    if runner.refused:
        return Trials.none(len(rows))
    # Once for all changes: they are of driver, vehicle and grip, not of roads.
    roads, which = runner.roads_of(X)
    parts, order = [], []
    # A batch has one driver, so rows are simulated together by what is changed.
    for number in np.unique(numbers).tolist():
        at = np.flatnonzero(numbers == number)
        fix = runner.fixes[number] if number >= 0 else None
        noise = runner.noise_keys(keys[at])
        rollout = runner.run(X[at], fix=fix, noise=noise, roads=(roads, which[at]))
        order.append(at)
        parts.append(Trials.of(rollout, roads, which[at], harm, count))
    return Trials.join(parts).take(np.argsort(np.concatenate(order)))
