"""Recompute every number of a safety case: python recompute.py [FOLDER of safety-case.json].

It needs Python 3.11 alone, and imports nothing of BridgeGen: the definitions are written here once
more. Checked are the SHA-256 of the files, each number, the texts with their numbers put in again,
and the status of each goal. Exit status 1: something differs; 2: a file cannot be read.
"""

import hashlib
import json
import math
import re
import sqlite3
import sys
from bisect import bisect_right
from collections.abc import Iterator
from decimal import ROUND_CEILING, ROUND_FLOOR, ROUND_HALF_EVEN, Context, Decimal
from itertools import combinations
from pathlib import Path
from typing import Any

ROUND = {"percent": ROUND_HALF_EVEN, "percent_up": ROUND_CEILING, "percent_down": ROUND_FLOOR}
FIT = "status = 0 AND implausible IS NULL"  # has a result, and traffic that could happen
HARMFUL = FIT + " AND {harm} >= 0.3"  # a near miss or a collision
WAY = "conflict || '|' || conflict_type || '|' || responsible || '|' || coalesce(rule, '')"
COUNTS = {
    "evaluations": "1",
    "failed": "status != 0",
    "implausible": "status = 0 AND implausible IS NOT NULL",
    "critical": "critical",
    "collisions": "status = 0 AND {n_collision} > 0",
    "not_preventable": FIT + " AND {n_collision} > 0 AND {harm} < 0.3",
    "harmful": "{bad}",
    "other_causes": HARMFUL + " AND NOT critical",
    "way": "{bad} AND " + WAY + " = {of}",
    "met": "{margin} >= 0",
    "violated": "{margin} < 0",
    "unknown": "{margin} IS NULL",
}
VALUES = {
    "d_min": "min({d_min}) FROM evaluations WHERE status = 0",
    "worst": "min({margin}) FROM evaluations",
    "worst_at": "id + 1 FROM evaluations WHERE {margin} IS NOT NULL ORDER BY {margin}, id",
    "least": "{worth} FROM evaluations WHERE {near} ORDER BY {worth} {order}, id",
    "least_at": "id + 1 FROM evaluations WHERE {near} ORDER BY {worth} {order}, id",
    "at": "id + 1 FROM evaluations WHERE id = {row}",
    "harm": "{harm} FROM evaluations WHERE id = {row}",
    "severity": "{severity} FROM evaluations WHERE id = {row}",
}


def tail(k: int, n: int, p: float) -> float:
    """Return the binomial probability of k or more of n, as a sum of ever smaller terms."""
    up = k > n * p
    i, total = (k if up else k - 1), 0.0
    term = math.lgamma(n + 1) - math.lgamma(i + 1) - math.lgamma(n - i + 1)
    term = math.exp(term + i * math.log(p) + (n - i) * math.log1p(-p))
    while term > 1e-17 * total:
        total += term
        term *= (n - i) / (i + 1) * p / (1 - p) if up else i / (n - i + 1) * (1 - p) / p
        i += 1 if up else -1
    return total if up else 1.0 - total


def bound(k: int, n: int, upper: bool, confidence: float) -> float:
    """Return an end of the two-sided Clopper-Pearson interval of k of n, by bisection."""
    if k == (n if upper else 0):
        return float(upper)
    low, high, target = 0.0, 1.0, 0.5 + (upper - 0.5) * confidence
    for _ in range(100):
        middle = 0.5 * (low + high)
        below = tail(k + upper, n, middle) < target
        low, high = (middle, high) if below else (low, middle)
    return 0.5 * (low + high)


def written(value: Any, form: str) -> str:
    """Return a value as the case writes it: bounds of shares are rounded outwards."""
    if form not in ROUND:
        return {"count": "{:,.0f}", "number": "{:.3g}", "text": "{}"}[form].format(value)
    share = Context(prec=3, rounding=ROUND[form]).create_decimal(Decimal(value) * 100)
    return f"{share.normalize():f} %"


def recompute(what: str, of: str, run: dict[str, Any], folder: Path, confidence: float) -> Any:
    """Return a number by its definition."""
    sql = sqlite3.connect(f"{(folder / 'run.sqlite').absolute().as_uri()}?mode=ro", uri=True)
    about = {key: json.loads(text) for key, text in sql.execute("SELECT * FROM run")}
    info = sql.execute("PRAGMA table_info(evaluations)")
    names = ['"' + item[1].replace('"', '""') + '"' for item in info]
    start = 4 + len(about["parameters"])  # after id, batch, seconds and u
    column = dict(zip(about["metrics"], names[start:], strict=False))
    column["harm"] = column["harm" if run["count"] == "ego" else "harm_any"]
    bad = HARMFUL.format(**column) + " AND critical" * bool(about["settings"].get("cause"))
    triage = json.loads((folder / "triage.json").read_text("utf-8"))
    modes, counted = (
        triage["modes"],
        {item["evaluation"]: item for item in triage["neighbourhoods"]},
    )
    mode = modes[int(of) - 1] if of.isdecimal() and 0 < int(of) <= len(modes) else {}
    course = "" if of == "harm" else f" AND {column['harm']} >= 0.1"  # on a collision course
    place = column | {
        "bad": bad,
        "margin": column.get(f"criterion:{of}"),
        "worth": column.get(of),
        "near": FIT + course,
        "order": "ASC" if of == "course_ttc" else "DESC",
        "of": "'" + of.replace("'", "''") + "'",
        "row": mode.get("worst"),
    }

    def ask(text: str) -> Any:
        return sql.execute("SELECT " + text.format(**place) + " LIMIT 1").fetchone()[0]

    if what in COUNTS or what in VALUES:
        return ask(VALUES.get(what) or f"count(*) FROM evaluations WHERE {COUNTS[what]}")
    if what in ("bins_all", "pairs_all"):
        sizes = [len(inner) + 1 for inner in run["edges"].values()]
        return sum(map(math.prod, combinations(sizes, 1 if what == "bins_all" else 2)))
    if what in ("bins_evaluated", "pairs_evaluated"):
        columns = [names[4 + about["parameters"].index(name)] for name in run["edges"]]
        rows = sql.execute(f"SELECT {', '.join(columns)} FROM evaluations WHERE status = 0")
        in_bins = {tuple(map(bisect_right, run["edges"].values(), row)) for row in rows}
        chosen = combinations(zip(*in_bins, strict=True), 1 if what == "bins_evaluated" else 2)
        return sum(len({*zip(*some, strict=True)}) for some in chosen)
    if what in ("ran", "confirmed"):
        there = [
            load["there"] for load in json.loads((folder / of).read_text("utf-8"))["scenarios"]
        ]
        return sum(item is not None and (what == "ran" or item["critical"]) for item in there)
    if what in ("title", "count", "simplest"):
        return mode["minimal"]["sentence"] if what == "simplest" else mode[what]
    if what in ("neighbours", "still_harmful"):
        return counted[mode["shown"]]["rows" if what == "neighbours" else "harmful"]
    if what == "modes":
        return len(modes) + triage["unrecorded_modes"]
    if what == "robust_modes":  # half of the neighbours are harmful, or none were simulated
        around = [counted.get(item["shown"], {"rows": 0, "harmful": 0}) for item in modes]
        return sum(2 * item["harmful"] >= item["rows"] for item in around)
    if run["drawn"] == "fresh":
        harm = [item for item in triage["fresh"]["harm"] if item is not None]
        drawn, n, k = len(triage["fresh"]["harm"]), len(harm), sum(item >= 0.3 for item in harm)
    else:
        drawn, n, k = (ask(f"count(*) FROM evaluations WHERE {item}") for item in ("1", FIT, bad))
    if what == "failures":  # those of the search, and of the draws besides
        return ask(f"count(*) FROM evaluations WHERE {bad}") + k * (run["drawn"] == "fresh")
    if what in ("share_low", "share_high"):
        return bound(k, n, what == "share_high", confidence)
    return {"drawn": drawn, "drawn_known": n, "drawn_harmful": k, "share": k / n}[what]


def status(name: str, case: dict[str, Any], numbers: dict[str, Any]) -> set[str]:
    """Return the status of a goal as numbers and goals below make it; of a strategy, of its."""
    element = next(item for item in case["elements"] if item["id"] == name)
    at = [(item["kind"], item["source"], item["target"]) for item in case["relations"]]
    below = [end for kind, item, end in at if kind == "SupportedBy" and item == name]
    found = {each for item in below for each in status(item, case, numbers)}
    if element["kind"] not in ("Goal", "CounterGoal"):
        return found
    if element["undeveloped"]:
        return {"undeveloped"}
    holds = element["holds"]
    if holds and numbers[holds["number"]] != numbers.get(holds["equals"], 0):
        return {"not supported"}
    if "not supported" in found or any(k == "Challenges" and end == name for k, _, end in at):
        return {"not supported"}
    return {"incomplete" if found & {"undeveloped", "incomplete"} else "supported"}


def check(base: Path) -> Iterator[tuple[str, Any, Any, bool | None]]:
    """Yield each claim, what the case states, what is found, and whether they agree."""
    case = json.loads((base / "safety-case.json").read_text("utf-8"))
    for item in case["evidence"]:
        digest = hashlib.sha256((base / item["file"]).read_bytes()).hexdigest()
        yield f"SHA-256 {item['file']}", item["sha256"][:16], digest[:16], digest == item["sha256"]
    runs, numbers, texts = {item["id"]: item for item in case["runs"]}, {}, {}
    known = {item["id"] for item in case["numbers"]}
    for item in case["numbers"]:
        name, stated, form = item["id"], item["value"], item["form"]
        owner, _, rest = name.partition(".")
        what, found = rest.partition(":")[0].rstrip("0123456789"), stated
        if name == "all.joint":  # Bonferroni's inequality
            bounds = sum(f"{run}.share" in known for run in runs)
            found = max(0.0, round(1 - bounds * (1 - case["confidence"]), 12))
        elif not what.endswith("_feasible"):  # which bins are feasible, the scenario says
            place = base / runs[owner]["folder"]
            found = recompute(what, item["of"], runs[owner], place, case["confidence"])
        near = isinstance(found, float) and math.isclose(found, stated, rel_tol=1e-9, abs_tol=1e-12)
        same = (near or found == stated) and item["text"] == written(stated, form)
        numbers[name], texts[name] = found, item["text"]
        if what.endswith("_feasible"):
            yield name, item["text"], f"not recomputable; again: {item['again']}", None
        else:
            yield name, item["text"], written(found, form), same
    for item in case["elements"]:
        for said in (item["statement"], *item["details"]):
            made = re.sub(r"\{([\w.:-]+)\}", lambda m: texts.get(m[1], m[0]), said["template"])
            if said["template"] and made != said["text"]:
                yield f"text of {item['id']}", said["text"], made, False
        if item["status"]:
            (word,) = status(item["id"], case, numbers)
            yield f"status of {item['id']}", item["status"], word, item["status"] == word


def main() -> int:
    """Print the table; return the exit status."""
    base = Path(sys.argv[1] if len(sys.argv) > 1 else __file__)
    base = base if base.is_dir() else base.parent
    try:
        rows = list(check(base))
    except (OSError, ValueError, LookupError, TypeError, sqlite3.Error) as error:
        print(f"{base}: cannot be checked: {type(error).__name__}: {error}", file=sys.stderr)
        return 2
    for name, stated, found, same in rows:
        word = "-" if same is None else "agrees" if same else "DIFFERS"
        print(f"{word:<8}{name:<32}{stated!s:.60} | {found!s:.60}")
    odd, rest = (sum(row[3] is kind for row in rows) for kind in (False, None))
    digest = hashlib.sha256((base / "safety-case.json").read_bytes()).hexdigest()
    print(f"\nSHA-256 of safety-case.json: {digest}")
    print(f"{len(rows)} checks: {odd} differ, {rest} not recomputable from the files.")
    return int(odd > 0)


if __name__ == "__main__":
    sys.exit(main())
