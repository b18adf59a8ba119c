"""What the paper says of its methods, and whether our runs say the same."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.statistics import a12, holm, mann_whitney, quartiles
from bridgegen.jobs.compare.measures import Measured
from bridgegen.jobs.compare.words import SURE, p_value
from bridgegen_reproduction import paper
from bridgegen_reproduction.numbers import number
from bridgegen_reproduction.results import Results
from bridgegen_reproduction.table import Table


@dataclass(frozen=True)
class Claim:
    """One method is ahead of another in a quantity.

    Attributes:
        group: of the two.
        quantity: of Table VI; or "hypervolume" or "spread", of which the paper prints curves.
        title: what people call it.
        ahead: the algorithm that the paper finds ahead.
        behind: the other.
        larger: whether ahead means larger.
        digits: of the quantity.
    """

    group: str
    quantity: str
    title: str
    ahead: str
    behind: str
    larger: bool
    digits: int


def _claims() -> tuple[Claim, ...]:
    kinds = {
        "r_critic": ("R_critic", True, 3),
        "t_critic": ("T_critic", False, 2),
        "median_d_min": ("median d_min [m]", False, 2),
        "median_v_d": ("median v_d [km/h]", True, 2),
        "median_fitness": ("median fitness", True, 2),
        "hypervolume": ("hypervolume", True, 3),
        "spread": ("spread Δ", False, 3),
    }
    said = [
        *(
            ("single", q, "ppo", "random")
            for q in ("r_critic", "t_critic", "median_d_min", "median_v_d", "median_fitness")
        ),
        *(
            ("single", q, "pso", "random")
            for q in ("r_critic", "t_critic", "median_d_min", "median_v_d")
        ),
        ("single", "r_critic", "ppo", "pso"),
        ("single", "t_critic", "ppo", "pso"),
        *(
            ("many", q, "nsga2-dt", "random")
            for q in ("r_critic", "t_critic", "median_d_min", "median_v_d", "hypervolume", "spread")
        ),
    ]
    found = []
    for group, quantity, ahead, behind in said:
        title, larger, digits = kinds[quantity]
        found.append(Claim(group, quantity, title, ahead, behind, larger, digits))
    return tuple(found)


CLAIMS = _claims()
"""Every order of two methods that Section V-C tells, but for PSO's fitness, a misprint, and the
runtimes, which are another simulator's."""


@dataclass(frozen=True)
class Verdict:
    """What our runs say of a claim in one scenario.

    Attributes:
        ahead: median of the method that the paper finds ahead; NaN without a run.
        behind: of the other.
        p: of the two-sided Mann-Whitney U test, corrected by Holm's method for all claims of the
            scenario; NaN where there is nothing to test.
        a12: how probable it is that a run of the first is ahead of one of the second.
        word: "holds", "opposite" or "not shown"; "agrees" or "disagrees" by the medians alone,
            where there are too few runs to show anything; "–" where there is
            nothing to compare.
    """

    ahead: float
    behind: float
    p: float
    a12: float
    word: str


def judge(results: Results, measured: Mapping[str, Mapping[str, Float]]) -> tuple[Verdict, ...]:
    """Return a verdict on each of `CLAIMS`.

    Args:
        results: of a scenario.
        measured: by algorithm, "hypervolume" and "spread" of its runs.
    """
    pairs = []
    for claim in CLAIMS:
        ahead, behind = (
            measured.get(name, {}).get(claim.quantity, np.empty(0))
            if claim.quantity in ("hypervolume", "spread")
            else results.values(claim.group, name, claim.quantity)
            for name in (claim.ahead, claim.behind)
        )
        pairs.append((ahead, behind))
    corrected = holm([mann_whitney(x, y) for x, y in pairs])
    return tuple(
        _verdict(claim, x, y, p) for claim, (x, y), p in zip(CLAIMS, pairs, corrected, strict=True)
    )


def can_show(seeds: int) -> bool:
    """Return whether so many runs of each method could show anything, did they differ entirely."""
    array = np.arange(float(seeds))
    return mann_whitney(array, array + seeds) * len(CLAIMS) < SURE


def _verdict(claim: Claim, x: Float, y: Float, p: float) -> Verdict:
    ahead, behind = quartiles(x).median, quartiles(y).median
    effect = a12(x, y, larger_is_better=claim.larger)
    if np.isnan(effect):
        word = "–"
    elif not can_show(min(len(x), len(y))):
        is_so = ahead > behind if claim.larger else ahead < behind
        word = "agrees" if is_so else "disagrees"
    elif p < SURE and effect != 0.5:
        word = "holds" if effect > 0.5 else "opposite"
    else:
        word = "not shown"
    return Verdict(ahead, behind, p, effect, word)


def of_fronts(measured: Measured, algorithms: Sequence[str]) -> dict[str, dict[str, Float]]:
    """Return the hypervolume and the spread of each algorithm's runs in one scenario."""
    return {
        name: {
            key: np.array([v[key] for cell, v in measured.values.items() if cell.algorithm == name])
            for key in ("hypervolume", "spread")
        }
        for name in algorithms
    }


def table_claims(verdicts: Mapping[str, Sequence[Verdict]], seeds: int) -> Table:
    """Return every claim beside what our runs say of it.

    Args:
        verdicts: by scenario, the main one among them.
        seeds: runs of each method.
    """
    others = [name for name in sorted(verdicts) if name != paper.MAIN]
    rows = []
    data: list[tuple[object, ...]] = [
        ("scenario", "objectives", "quantity", "ahead", "behind", "paper_ahead", "paper_behind",
         "median_ahead", "median_behind", "p_holm", "a12", "verdict")
    ]  # fmt: skip
    for k, claim in enumerate(CLAIMS):
        verdict, printed = verdicts[paper.MAIN][k], _printed(claim)
        told = (
            " : ".join(number(value, claim.digits) for value in printed) if printed else "a curve"
        )
        rows.append(
            (
                f"{paper.TITLES[claim.ahead]} ahead of {paper.TITLES[claim.behind]}: {claim.title}",
                told,
                f"{number(verdict.ahead, claim.digits)} : {number(verdict.behind, claim.digits)}",
                p_value(verdict.p),
                number(verdict.a12, 2),
                verdict.word,
                *(verdicts[name][k].word for name in others),
            )
        )
        for name in verdicts:
            v = verdicts[name][k]
            told_of = printed if printed and name == paper.MAIN else (None, None)
            data.append(
                (
                    name,
                    claim.group,
                    claim.quantity,
                    claim.ahead,
                    claim.behind,
                    *told_of,
                    v.ahead,
                    v.behind,
                    v.p,
                    v.a12,
                    v.word,
                )
            )
    notes = [
        "The claims are the orders of Section V-C. Ours: medians over the seeds; p is that of the "
        f"two-sided Mann–Whitney U test, corrected by Holm’s method for the {len(CLAIMS)} claims "
        "of a scenario; A12, by Vargha and Delaney, how probable it is that a run of the first is "
        f"ahead. A claim holds, or its opposite does, where p < {SURE}; else neither is shown.",
    ]
    if not can_show(seeds):
        notes.append(
            f"{seeds} seed{'s' if seeds > 1 else ''} cannot show anything: ours agree or disagree "
            "by their medians alone. Ask for ten seeds (--seeds)."
        )
    return Table(
        "claims",
        "What the paper claims, and what our runs say",
        ("claim", "paper", "ours, S4", "p", "A12", "S4", *(f"S{name[-1]}" for name in others)),
        tuple(rows),
        tuple(notes),
        tuple(data),
    )


def _printed(claim: Claim) -> tuple[float, float] | None:
    values = [
        paper.RESULTS[claim.group, name].get(claim.quantity) for name in (claim.ahead, claim.behind)
    ]
    if values[0] is None or values[1] is None:
        return None
    return values[0], values[1]
