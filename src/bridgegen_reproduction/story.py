"""The document: what was reproduced, what was not, and why, in sentences, tables and figures."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from bridgegen.jobs.compare.plan import Cell
from bridgegen_reproduction import paper
from bridgegen_reproduction.claims import CLAIMS, Verdict, table_claims
from bridgegen_reproduction.document import (
    Block,
    Command,
    Document,
    Folded,
    Picture,
    Points,
    Section,
    Shown,
    Text,
)
from bridgegen_reproduction.limits import limits
from bridgegen_reproduction.numbers import number, share
from bridgegen_reproduction.perception import Causes, Paired, table_causes, table_paired
from bridgegen_reproduction.printed import (
    table_2,
    table_3,
    table_4,
    table_5,
    table_6,
    table_6_others,
    table_6_runtime,
)
from bridgegen_reproduction.protocol import PARTS, Protocol
from bridgegen_reproduction.results import Results
from bridgegen_reproduction.runs import Runs
from bridgegen_reproduction.table import Table

RUNS_FILE = "runs.csv"

FEW = 50
"""Fewer critical scenarios than these say little about causes."""


@dataclass(frozen=True)
class Found:
    """The results of all runs.

    Attributes:
        protocol: what was run.
        runs: those that have ended.
        gaps: why others failed, by part's name and cell.
        results: by scenario, the main one first.
        verdicts: on each claim, by scenario.
        causes: with the reference driver.
        paired: the same random scenarios with sensors and with ideal perception.
        commands: by part's name, the command line that writes that comparison's own page.
    """

    protocol: Protocol
    runs: Runs
    gaps: Mapping[tuple[str, Cell], str]
    results: Mapping[str, Results]
    verdicts: Mapping[str, Sequence[Verdict]]
    causes: Sequence[Causes]
    paired: Sequence[Paired]
    commands: Mapping[str, str]

    @property
    def main(self) -> Results:
        """Of the scenario that the paper examines in detail."""
        return self.results[paper.MAIN]


def tell(found: Found, pictures: Mapping[str, Picture]) -> Document:
    """Return the document.

    Args:
        found: the results of the runs.
        pictures: by name; one that is not there is left out.
    """
    protocol = found.protocol

    def drawn(*names: str) -> list[Block]:
        return [pictures[name] for name in names if name in pictures]

    others = [result for name, result in found.results.items() if name != paper.MAIN]
    results: list[Block] = [Shown(table_6(found.main, protocol))]
    if others:
        results.append(Shown(table_6_others(others, protocol)))
    results.append(Shown(table_6_runtime(found.main, protocol), timed=True))
    claims = Shown(table_claims(found.verdicts, protocol.seeds))
    return Document(
        "The paper’s evaluation, reproduced",
        tuple(_facts(found)),
        (
            Section("In short", (Points(tuple(in_short(found))), claims)),
            Section("Results", tuple(results)),
            Section(
                "One objective",
                tuple(drawn("single-iterations", "single-violins")),
            ),
            Section(
                "Many objectives",
                tuple(drawn("many-iterations", "many-violins", "hypervolume-spread")),
            ),
            Section(
                "Perception",
                (
                    Shown(table_causes(found.causes)),
                    *drawn("causes"),
                    Shown(table_paired(found.paired)),
                ),
            ),
            Section(
                "The experiment",
                (
                    Shown(table_2(protocol.scenarios)),
                    *drawn("collision-points"),
                    Shown(table_3(found.runs)),
                    Shown(table_4(found.runs, protocol)),
                    Shown(table_5(found.runs, protocol)),
                    *drawn("ontology"),
                ),
            ),
            Section("What cannot be reproduced, and why", (Points(limits(protocol)),)),
            Section("Make it again", tuple(_again(found))),
        ),
    )


def _facts(found: Found) -> list[str]:
    protocol = found.protocol
    facts = [
        "Section V, Tables II to VI",
        f"{protocol.seeds} seed{'s' if protocol.seeds > 1 else ''}",
        f"{protocol.iterations} iterations × {paper.POPULATION}",
        f"{len(found.runs):,} runs, {sum(len(run.critical) for run in found.runs.values()):,} "
        "evaluations",
    ]
    if protocol.road_map:
        facts.append(f"on {protocol.road_map.name}")
    if found.gaps:
        facts.append(f"{len(found.gaps)} runs failed")
    return facts


def in_short(found: Found) -> list[tuple[str, str]]:
    """Return what was found, in sentences."""
    told = [("The orders that the paper finds", _orders(found))]
    told.append(("R_critic on S4", _shares(found)))
    told.append(("Perception", _perception(found)))
    if found.paired:
        told.append(("The same scenarios, perceived ideally", _pairs(found.paired)))
    if "ppo" in found.protocol.missing:
        told.append(
            (
                "PPO is missing",
                "It needs the extra rl: pip install 'bridgegen[rl]', then the same command again.",
            )
        )
    if found.gaps:
        which = ", ".join(f"{part}/{cell.name} ({why})" for (part, cell), why in found.gaps.items())
        told.append(("Runs that failed", f"{which}. The same command tries them again."))
    return told


def _orders(found: Found) -> str:
    verdicts = found.verdicts[paper.MAIN]
    count = Counter(verdict.word for verdict in verdicts)
    asked = len(verdicts) - count["–"]
    told = []
    if count["holds"] or count["opposite"] or count["not shown"]:
        told.append(
            f"{count['holds']} hold in our runs of S4, {count['opposite']} are the other way "
            f"round, {count['not shown']} are not shown either way"
        )
    if count["agrees"] or count["disagrees"]:
        told.append(
            f"{count['agrees']} are the same in our runs of S4 by their medians alone, and "
            f"{count['disagrees']} are not: so few seeds can show nothing"
        )
    text = (
        f"Of the {asked} orders of two methods that Section V-C tells and that could be tried, "
        f"{'; '.join(told) or 'none was'}."
    )
    other = [
        f"{paper.TITLES[c.ahead]} ahead of {paper.TITLES[c.behind]} in {c.title}"
        for c, v in zip(CLAIMS, verdicts, strict=True)
        if v.word in ("opposite", "disagrees")
    ]
    return text + (f" Other than the paper has it: {'; '.join(other)}." if other else "")


def _shares(found: Found) -> str:
    parts = []
    for group, methods in paper.GROUPS.items():
        for method in methods:
            if group == "many" and method is paper.RS:
                continue
            ours = found.main.quartiles(group, method.algorithm, "r_critic").median
            printed = paper.RESULTS[group, method.algorithm]["r_critic"]
            parts.append(f"{method.title} {number(ours, 3)} (paper: {number(printed, 3)})")
    text = ", ".join(parts) + "."
    random = found.main.quartiles("single", "random", "r_critic").median
    printed = paper.RESULTS["single", "random"]["r_critic"]
    if random < 0.5 * printed or random > 2.0 * printed:
        text += (
            f" Random sampling finds {number(random, 3)} where the paper’s finds "
            f"{number(printed, 3)}: what is searched differs, for the paper prints no ranges. "
            "So compare the methods with each other, not with the paper’s numbers."
        )
    return text


def _perception(found: Found) -> str:
    total = sum(cause.critical for cause in found.causes)
    gone = sum(cause.vanish for cause in found.causes)
    text = (
        f"With the reference driver, who perceives by camera and LiDAR, {gone:,} of {total:,} "
        f"critical scenarios ({share(gone, total)}) vanish with ideal perception, all scenarios "
        "and seeds together: what a test of planning and control alone would miss"
    )
    by_method = []
    for method in paper.METHODS:
        these = [cause for cause in found.causes if cause.algorithm == method.algorithm]
        critical, vanish = (
            sum(causes.critical for causes in these),
            sum(causes.vanish for causes in these),
        )
        if critical:
            by_method.append(f"{method.title} {share(vanish, critical)} of {critical:,}")
    text += f". By method: {', '.join(by_method)}." if by_method else "."
    here = [cause for cause in found.causes if cause.scenario == paper.MAIN]
    critical = sum(causes.critical for causes in here)
    evaluations = sum(causes.evaluations for causes in here)
    if here:
        text += (
            f" On S4 it comes to harm in {critical:,} of {evaluations:,} evaluations, of which "
            f"{sum(causes.vanish for causes in here):,} vanish"
            + (": too few to go by, so look at the others." if critical < FEW else ".")
        )
    return text


def _pairs(paired: Sequence[Paired]) -> str:
    real, ideal = sum(item.real for item in paired), sum(item.ideal for item in paired)
    vanish, appear = sum(item.vanish for item in paired), sum(item.appear for item in paired)
    return (
        f"The same {sum(item.evaluations for item in paired):,} random scenarios were run once "
        "more "
        f"with ideal perception: {vanish:,} of {real:,} critical ones vanish, and {appear:,} "
        f"others become critical, which leaves {ideal:,}."
    )


def _again(found: Found) -> list[Block]:
    protocol = found.protocol
    parts = [
        (
            f"{part.name}/",
            f"Runs of {part.title}; the driver is {part.ego}"
            + (f", its {', '.join(part.ideal)} ideal." if part.ideal else "."),
        )
        for part in PARTS
    ]
    return [
        Command(protocol.command()),
        Text(
            "The same command goes on where it was stopped, makes more runs where more seeds are "
            "asked for, and gives the same files, to the byte, but for what is made of seconds."
        ),
        Points(
            (
                *parts,
                (
                    "A run",
                    "is an ordinary run’s folder: “bridgegen resume FOLDER” hands its critical "
                    "scenarios over and writes its report, with playback.",
                ),
                (
                    "All measures",
                    "of “bridgegen benchmark algorithms”, with tests and figures for each "
                    "scenario, are written by these commands, which find the runs made:",
                ),
            )
        ),
        *(Command(command) for command in found.commands.values()),
        Folded("Every run, and the command that makes it again", _run_table(found), RUNS_FILE),
    ]


def _run_table(found: Found) -> Table:
    rows = []
    for part, cell in found.protocol.cells():
        run = found.runs.get((part.name, cell))
        if run is None:
            continue
        rows.append(
            (
                part.name,
                f"S{cell.scenario[-1]}",
                paper.TITLES[cell.algorithm],
                f"{cell.seed}",
                f"{len(run.critical):,}",
                f"{len(run.hits):,}",
                run.folder,
                run.command,
            )
        )
    head = ("part", "scenario", "method", "seed", "evaluations", "critical", "folder", "command")
    return Table("runs", "Every run", head, tuple(rows))
