"""Tables II to VI, ours beside the paper's."""

from collections.abc import Mapping, Sequence

import numpy as np

from bridgegen.assess.objective import Objective
from bridgegen.scenario.language.objectives import PAPERS
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.language.story import Participant
from bridgegen.search import algorithms as toolkit
from bridgegen_reproduction import paper
from bridgegen_reproduction.numbers import number, spread
from bridgegen_reproduction.protocol import PRINTED, Protocol
from bridgegen_reproduction.results import QUANTITIES, TIMED, Quantity, Results
from bridgegen_reproduction.runs import Runs, of
from bridgegen_reproduction.table import Table

TERMS = tuple(paper.WEIGHTS)


def table_2(scenarios: Sequence[str]) -> Table:
    """Return the logical scenarios: where who drives, how fast, and what is searched of it."""
    rows = []
    for name in sorted(scenarios):
        printed, ours = paper.DESIGNS[name], load(paper.shipped(name))
        ego, bv = (
            ours.ego,
            next(participant for participant in ours.participants if participant is not ours.ego),
        )
        ego_speed, bv_speed = ours.parameters["ego_speed"], ours.parameters["bv_speed"]
        title = f"S{name[-1]}"
        rows.append(
            (
                title,
                "paper",
                *printed.ego,
                f"{printed.ego_speed:g} m/s",
                *printed.bv,
                f"{printed.bv_speed:g} m/s",
                printed.conflict,
            )
        )
        rows.append(
            (
                title,
                "ours",
                *_ends(ego),
                f"{ego_speed.default:g} m/s ({ego_speed.low:g} to {ego_speed.high:g})",
                *_ends(bv),
                f"{bv_speed.default:g} m/s ({bv_speed.low:g} to {bv_speed.high:g})",
                ours.title,
            )
        )
    return Table(
        "table-2",
        "Table II: logical scenarios",
        ("scenario", "", "S_ego", "E_ego", "V_ego", "S_BV", "E_BV", "V_BV", "C"),
        tuple(rows),
        (
            "Ours: the default, and the range that is searched. The paper prints no ranges but "
            "the ±2 m/s as which we read its sentence about the ego’s speed.",
            "Where the background vehicle (BV) starts, when it sets off, and the weather are "
            "searched, too; “bridgegen list parameters paper/crossroads-s4” tells all of it.",
        ),
        texts=9,
    )


def _ends(participant: Participant) -> tuple[str, str]:
    assert participant.end is not None
    return (
        paper.POINTS[participant.start.leg, participant.start.way],
        paper.POINTS[participant.end.leg, participant.end.way],
    )


def table_3(runs: Runs) -> Table:
    """Return what counts as critical, and the weights of the fitness."""
    limits = PAPERS.critical
    known = [
        ("n_collision", ">", paper.THRESHOLDS["n_collision_above"], limits.n_collision_above, ""),
        ("d_min", "<", paper.THRESHOLDS["d_min_below"], limits.d_min_below, " m"),
        ("v_d", "≥", paper.THRESHOLDS["v_d_at_least"], limits.v_d_at_least, " m/s"),
    ]
    rows = [
        (f"threshold of {name}", f"{sign} {printed:g}", f"{sign} {ours:g}{unit}", "")
        for name, sign, printed, ours, unit in known
    ]
    weights = {term.metric: term.weight for term in PAPERS.terms}
    entropy = entropy_weights(runs)
    for name, symbol, column in (("d_min", "a1", 0), ("v_d", "a2", 1)):
        found = [pair[column] for pair in entropy]
        middle = number(float(np.median(found)), 4) if found else "–"
        reach = f" ({number(min(found), 4)} to {number(max(found), 4)})" if len(found) > 1 else ""
        ours = weights[name]
        rows.append(
            (
                f"{symbol}, weight of {name}",
                f"{paper.WEIGHTS[name]:g}",
                "–" if ours is None else f"{ours:g}",
                middle + reach,
            )
        )
    return Table(
        "table-3",
        "Table III: what is critical; and the weights of the fitness",
        ("", "paper", "ours", "entropy of our random runs"),
        tuple(rows),
        (
            "Critical: a collision, or closer than 2 m while the ego goes at 1 m/s or more. The "
            "paper prints no units, and not how the three go together.",
            "The weights are the paper’s, so that fitness is the same quantity. The last column is "
            "what Eqs. 4 to 7 make of the random runs of S4: median, least and largest of the "
            "seeds. They depend on the sample, and so on the ranges that are searched.",
        ),
    )


def entropy_weights(runs: Runs) -> list[tuple[float, ...]]:
    """Return the weights by the paper's Eqs. 4 to 7, of each random run of the main scenario."""
    found = []
    for run in of(runs, PRINTED, paper.MAIN, paper.RS.algorithm):
        metrics = np.column_stack([run.d_min, run.v_d])
        if np.isnan(metrics).all(axis=1).all():
            continue
        sampled = Objective.build(
            tuple((name, None) for name in TERMS), weights="entropy", sample=(metrics, TERMS)
        )
        found.append(sampled.weights)
    return found


def table_4(runs: Runs, protocol: Protocol) -> Table:
    """Return the hyper-parameters of the methods of one objective."""
    return _hyperparameters(
        "table-4", "Table IV: hyper-parameters, one objective", "single", runs, protocol
    )


def table_5(runs: Runs, protocol: Protocol) -> Table:
    """Return the hyper-parameters of the methods of many objectives."""
    return _hyperparameters(
        "table-5", "Table V: hyper-parameters, many objectives", "many", runs, protocol
    )


def _hyperparameters(name: str, title: str, group: str, runs: Runs, protocol: Protocol) -> Table:
    rows = []
    for method in paper.GROUPS[group]:
        made = of(runs, PRINTED, paper.MAIN, method.algorithm)
        declared = toolkit.get(method.algorithm).settings
        ours: Mapping[str, object] = (
            made[0].settings
            if made
            else {key: setting.default for key, setting in declared.items()}
        )
        printed = {
            "population": paper.POPULATION,
            **paper.HYPERPARAMETERS.get(method.algorithm, {}),
        }
        rows.append(
            (
                method.title,
                "iterations",
                f"{paper.ITERATIONS}",
                f"{protocol.iterations}",
                "batches of a run; the budget is this × population",
            )
        )
        for key in dict.fromkeys((*printed, *ours)):
            told = f"{printed[key]:g}" if key in printed else "–"
            rows.append((method.title, key, told, f"{ours[key]}", declared[key].text))
    return Table(
        name,
        title,
        ("method", "setting", "paper", "ours", "what it is"),
        tuple(rows),
        ("“–”: the paper does not say; ours is a default of BridgeGen’s.",),
        texts=5,
    )


def table_6(results: Results, protocol: Protocol) -> Table:
    """Return Table VI: the results of the main scenario."""
    return _results(
        results,
        protocol,
        QUANTITIES,
        "table-6",
        "Table VI: results, S4",
        (
            f"Ours: the median over {_seeds(protocol)}"
            + (" and, in brackets, its quartiles." if protocol.seeds > 1 else ".")
            + " The paper gives one number each.",
            f"T_critic: evaluations until the {results.k}th critical scenario, divided by the "
            "least "
            "median of the methods on its side of the table; the paper does not define it.",
            "RS takes no notice of objectives, so that its runs are the same in both halves; the "
            "paper "
            "has another sample in each.",
            *_misprints(),
            *_without(protocol),
        ),
    )


def table_6_runtime(results: Results, protocol: Protocol) -> Table:
    """Return Table VI's last row, and T_critic in seconds: what is not the same the next time."""
    return _results(
        results,
        protocol,
        TIMED,
        "table-6-runtime",
        "Table VI: runtime, S4",
        (
            "Seconds of one run on this machine, in one thread. The paper’s seconds are CARLA’s; "
            "here "
            "a scenario takes a fraction of a millisecond, so that it is the methods themselves "
            "that "
            "these seconds tell apart.",
            *_without(protocol),
        ),
    )


def _seeds(protocol: Protocol) -> str:
    return "one seed" if protocol.seeds == 1 else f"{protocol.seeds} seeds"


def _misprints() -> tuple[str, ...]:
    row = paper.RESULTS["single", "pso"]
    follows = paper.fitness(row["avg_d_min"], row["avg_v_d"])
    return (
        f"The paper’s fitness of PSO, {row['avg_fitness']:g}, does not follow from its own d_min "
        f"and v_d, which give −{paper.WEIGHTS['d_min']:g} · {row['avg_d_min']:g} + "
        f"{paper.WEIGHTS['v_d']:g} · {row['avg_v_d']:g} = {number(follows, 2)}: these two numbers "
        "cannot be reproduced.",
    )


def _without(protocol: Protocol) -> tuple[str, ...]:
    if "ppo" not in protocol.missing:
        return ()
    return (
        "PPO is missing: it needs the extra rl, pip install 'bridgegen[rl]'; then run the same "
        "command again.",
    )


def _results(
    results: Results,
    protocol: Protocol,
    quantities: Sequence[Quantity],
    name: str,
    title: str,
    notes: tuple[str, ...],
) -> Table:
    columns = [(group, item) for group, methods in paper.GROUPS.items() for item in methods]
    head = [
        "",
        *(
            part
            for group, column in columns
            for part in (f"{column.title}{_MARK[group]}, ours", "paper")
        ),
    ]
    data: list[tuple[object, ...]] = [
        ("quantity", "unit", "objectives", "method", "paper", "runs", "never", "q1", "median", "q3")
    ]
    rows = []
    for quantity in quantities:
        cells = [f"{quantity.title}{f' [{quantity.unit}]' if quantity.unit else ''}"]
        for group, method in columns:
            printed = paper.RESULTS[group, method.algorithm].get(quantity.name, float("nan"))
            if group not in quantity.groups:
                cells += ["/", "/"]
                continue
            values = results.values(group, method.algorithm, quantity.name)
            quartiles = results.quartiles(group, method.algorithm, quantity.name)
            runs = int(np.count_nonzero(~np.isnan(values)))
            never = int(np.count_nonzero(np.isinf(values)))
            cells.append(spread(quartiles, quantity.digits, several=runs > 1))
            cells.append(number(printed, quantity.digits))
            data.append(
                (
                    quantity.name,
                    quantity.unit,
                    group,
                    method.algorithm,
                    printed,
                    runs,
                    never,
                    quartiles.low,
                    quartiles.median,
                    quartiles.high,
                )
            )
        rows.append(tuple(cells))
    return Table(name, title, tuple(head), tuple(rows), notes, tuple(data))


_MARK = {"single": "", "many": " (many)"}


def table_6_others(found: Sequence[Results], protocol: Protocol) -> Table:
    """Return the results of the other scenarios, of which the paper prints none."""
    shown = [item for item in QUANTITIES if item.name in _OTHERS]
    head = (
        "scenario",
        "method",
        "objectives",
        *(f"{q.title}{f' [{q.unit}]' if q.unit else ''}" for q in shown),
    )
    rows = []
    data: list[tuple[object, ...]] = [
        ("scenario", "objectives", "method", "quantity", "runs", "q1", "median", "q3")
    ]
    for results in found:
        for group, methods in paper.GROUPS.items():
            for method in methods:
                cells = [f"S{results.scenario[-1]}", method.title, group]
                for quantity in shown:
                    values = results.values(group, method.algorithm, quantity.name)
                    quartiles = results.quartiles(group, method.algorithm, quantity.name)
                    runs = int(np.count_nonzero(~np.isnan(values)))
                    cells.append(spread(quartiles, quantity.digits, several=runs > 1))
                    data.append(
                        (
                            results.scenario,
                            group,
                            method.algorithm,
                            quantity.name,
                            runs,
                            quartiles.low,
                            quartiles.median,
                            quartiles.high,
                        )
                    )
                rows.append(tuple(cells))
    return Table(
        "table-6-others",
        "The same for the other scenarios, of which the paper prints no numbers",
        head,
        tuple(rows),
        _without(protocol),
        tuple(data),
        texts=3,
    )


_OTHERS = ("r_critic", "t_critic", "median_d_min", "median_v_d")
