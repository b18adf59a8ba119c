"""Part of recompute.py: figures of real tests (measured.csv), and the region that has evidence.

Needs Python 3.11 alone.
"""

import csv
import json
import math
import random
import sqlite3
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from statistics import mean, quantiles
from typing import Any

Groups = dict[str, list[tuple[float, float, float, float, int]]]
VERDICTS = {"accepted": "accepted", "refused": "not accepted", "undecided": "not decided"}
VERDICTS |= {"without": "no threshold", "valueless": "no simulated value"}


def simulated(folder: Path, scenario: str, quantity: str) -> tuple[int, float]:
    """Return the evaluation that is meant, from 1, and what it gave; not a number if nothing."""
    number = int(scenario.removeprefix("evaluation "))
    if scenario.isdecimal():
        path = folder / "critical" / f"{scenario:0>4}.json"
        number = json.loads(path.read_text("utf-8"))["row"] + 1
    sql = sqlite3.connect(f"{(folder / 'run.sqlite').absolute().as_uri()}?mode=ro", uri=True)
    about = dict(sql.execute("SELECT * FROM run"))
    at = 4 + len(json.loads(about["parameters"])) + json.loads(about["metrics"]).index(quantity)
    names = [item[1] for item in sql.execute("PRAGMA table_info(evaluations)")]
    column = '"' + names[at].replace('"', '""') + '"'
    words = f"SELECT status, {column} FROM evaluations WHERE id = {number - 1:d}"
    status, value = sql.execute(words).fetchone()
    return number, math.nan if status or value is None else value


def read(base: Path, runs: list[dict[str, Any]]) -> Groups:
    """Return (measured, simulated, uncertainty, threshold) of tests that are compared together."""
    path, groups = base / "measured.csv", defaultdict(list)
    lines = path.read_text("utf-8-sig").splitlines() if path.is_file() else []
    rows = [line for line in lines if line.strip() and line[0] != "#"]
    delimiter = ";" if ";" in "".join(rows[:1]) else ","
    for given in csv.DictReader(rows, delimiter=delimiter, restval=""):
        cell = {name.strip(): text.strip() for name, text in given.items()}
        folders = {run["id"]: (base / run["folder"]).resolve() for run in runs}
        run = next(name for name, at in folders.items() if cell["run"] in ("", at.name))
        number, value = simulated(folders[run], cell["scenario"], cell["quantity"])
        numbers = (float(cell[name] or "nan") for name in ("measured", "uncertainty", "threshold"))
        measured, off, most = numbers
        key = f"{run}|{cell['series'] or f'evaluation {number}'}|{cell['quantity']}"
        groups[key].append((measured, value, 0.0 if math.isnan(off) else off, most, number - 1))
    return groups


def area(some: list[Any]) -> float:
    """Return the area between the distributions of what was measured and simulated."""
    measured, values = (sorted(test[i] for test in some) for i in (0, 1))
    return float(mean(abs(a - b) for a, b in zip(measured, values, strict=True)))


def compared(some: list[Any]) -> dict[str, Any]:
    """Return area, 95 % interval, means and verdict of tests that are compared together."""
    if not all(math.isfinite(test[1]) for test in some):
        return {"verdict": "no simulated value"}
    draw, most, off = random.Random(0), some[0][3], mean(test[2] for test in some)
    drawn = [area(draw.choices(some, k=len(some))) for _ in range(1000 * (len(some) > 5))]
    ends = quantiles(drawn or [area(some)] * 2, n=40)
    low, high = max(ends[0] - off, 0.0), ends[-1] + off
    word = "accepted" if high <= most else "not accepted" if low > most else "not decided"
    return {
        "area": area(some), "area_low": low, "area_high": high,
        "measured_mean": mean(test[0] for test in some),
        "simulated_mean": mean(test[1] for test in some),
        "verdict": "no threshold" if math.isnan(most) else word,
    }  # fmt: skip


def regions(base: Path, runs: list[dict[str, Any]], made: dict[Any, Any]) -> dict[Any, Any]:
    """Return least and greatest value of parameters in rows with evidence, by scenario.

    Args:
        base: the dossier's folder.
        runs: of the dossier.
        made: verdicts by (run, row, …).
    """
    found: dict[Any, Any] = defaultdict(lambda: defaultdict(list))
    for run in runs:
        folder = base / run["folder"]
        words = {word: {key[1] for key, one in made.items() if (key[0], one) == (run["id"], word)}
                 for word in ("accepted", "not accepted")}  # fmt: skip
        rows = words["accepted"] - words["not accepted"]
        for path in folder.glob("confirmation-*.json"):
            some = json.loads(path.read_text("utf-8"))["scenarios"]
            rows |= {one["evaluation"] for one in some if one["there"] and one["there"]["critical"]}
        sql = sqlite3.connect(f"{(folder / 'run.sqlite').absolute().as_uri()}?mode=ro", uri=True)
        about = {key: json.loads(text) for key, text in sql.execute("SELECT * FROM run")}
        settings = about["settings"]
        key = run["scenario"], settings["fingerprint"], settings["vehicle"]
        for row in rows:
            values = sql.execute("SELECT * FROM evaluations WHERE id = ?", [row]).fetchone()[4:]
            for name, value in zip(about["parameters"], values, strict=False):
                found[key][name].append(value)
    return found


def check(
    base: Path, dossier: dict[str, Any], written: Callable[[Any, str], str]
) -> Iterator[tuple[str, Any, Any, bool]]:
    """Yield each claim, what the dossier states, what is found, and whether they agree."""
    groups = read(base, dossier["runs"])
    made = {key: compared(some) for key, some in groups.items()}
    sizes, words = [len(some) for some in groups.values()], [m["verdict"] for m in made.values()]
    counts = {"tests": sum(sizes), "comparisons": len(sizes), "few": sum(n < 6 for n in sizes)}
    counts |= {name: words.count(word) for name, word in VERDICTS.items()}
    tests = {(key.partition("|")[0], test[4], key): made[key]["verdict"]
             for key, some in groups.items() for test in some}  # fmt: skip
    spans = regions(base, dossier["runs"], tests)
    counts["regions"] = len(spans)
    for item in dossier["numbers"]:
        if item["source"] in ("measured.csv", "validated.json"):
            name = item["id"].removeprefix("all.").partition(":")[0]
            found = made[item["of"]][name] if item["of"] else counts[name]
            same = math.isclose(found, item["value"], rel_tol=1e-9, abs_tol=1e-12)
            text = written(found, item["form"])
            yield item["id"], item["text"], text, same and item["text"] == text
    for one in dossier["validated"]:
        found = spans[one["scenario"], one["fingerprint"], one["vehicle"]]
        for name, (low, high, _) in one["ranges"].items():
            ends = [min(found[name]), max(found[name])]
            yield f"region of {one['scenario']}: {name}", [low, high], ends, ends == [low, high]
    for one in dossier["comparisons"]:
        key = f"{one['run']}|{one['series']}|{one['quantity']}"
        found = made[key]["verdict"]
        yield f"verdict on {key}", one["verdict"], found, found == one["verdict"]
