"""Recompute every figure of a credibility dossier: python recompute.py [FOLDER of the JSON file].

It needs Python 3.11 alone, and imports nothing of BridgeGen: the definitions are written here once
more. Checked are the SHA-256 of the files, each figure, the texts with their figures put in again,
the status of each item, and what hangs on the time step. Exit status 1: something differs; 2: a
file cannot be read.
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
from pathlib import Path
from statistics import median, quantiles
from typing import Any

ROUND = {"percent": ROUND_HALF_EVEN, "percent_up": ROUND_CEILING, "percent_down": ROUND_FLOOR}
FIT = "status = 0 AND implausible IS NULL"  # has a result, and traffic that could happen
OUTSIDE = ("bits_compared", "bits_different", "installed")  # not in the files
SUMS = ("evaluations", "failed", "same", "bins_all", "bins_evaluated", "distributions")


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


def bound(k: int, n: int, upper: bool) -> float:
    """Return an end of the two-sided 95 % Clopper-Pearson interval of k of n, by bisection."""
    if k == (n if upper else 0):
        return float(upper)
    low, high = 0.0, 1.0
    for _ in range(100):
        middle = 0.5 * (low + high)
        below = tail(k + upper, n, middle) < (0.975 if upper else 0.025)
        low, high = (middle, high) if below else (low, middle)
    return 0.5 * (low + high)


def written(value: Any, form: str) -> str:
    """Return a value as the dossier writes it: bounds of shares are rounded outwards."""
    if form not in ROUND:
        return {"count": "{:,.0f}", "number": "{:.3g}"}[form].format(value)
    share = Context(prec=3, rounding=ROUND[form]).create_decimal(Decimal(value) * 100)
    return f"{share.normalize():f} %"


def of_run(run: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Return what the files of a run say."""
    sql = sqlite3.connect(f"{(folder / 'run.sqlite').absolute().as_uri()}?mode=ro", uri=True)
    about = {key: json.loads(text) for key, text in sql.execute("SELECT * FROM run")}
    info = sql.execute("PRAGMA table_info(evaluations)")
    names = ['"' + item[1].replace('"', '""') + '"' for item in info]
    start = 4 + len(about["parameters"])  # after id, batch, seconds and u
    column = dict(zip(about["metrics"], names[start:], strict=False))
    harm = column["harm" if run["count"] == "ego" else "harm_any"]
    bad = f"{FIT} AND {harm} >= 0.3" + " AND critical" * bool(about["settings"].get("cause"))

    def ask(what: str) -> Any:
        return sql.execute(f"SELECT {what} LIMIT 1").fetchone()[0]

    triage = json.loads((folder / "triage.json").read_text("utf-8"))
    checks = [(item["evaluation"], item["at"]) for item in triage.get("step_checks", [])]
    found = {name: ask(f"count(*) FROM evaluations WHERE {where}")
             for name, where in (("evaluations", "1"), ("drawn", "1"), ("failed", "status != 0"),
                                 ("drawn_known", FIT), ("drawn_harmful", bad))}  # fmt: skip
    again = (ask(f"{harm} FROM evaluations WHERE id = {row:d}") for row, _ in checks)
    found["same"] = sum(one == at[0]["harm"] for one, (_, at) in zip(again, checks, strict=True))
    found |= {"folder": folder, "version": about["version"], "checks": checks}
    found["distributions"] = about["settings"].get("distribution") is not None
    edges = [names[4 + about["parameters"].index(name)] for name in run["edges"]]
    rows = sql.execute(f"SELECT {', '.join(edges) or 1} FROM evaluations WHERE status = 0")
    inside = {tuple(map(bisect_right, run["edges"].values(), row)) for row in rows}
    found["bins_all"] = sum(len(inner) + 1 for inner in run["edges"].values())
    found["bins_evaluated"] = sum(len({*some}) for some in zip(*inside, strict=True))
    if run["drawn"] == "fresh":
        harms = [item for item in triage["fresh"]["harm"] if item is not None]
        found["drawn"] = len(triage["fresh"]["harm"])
        found |= {"drawn_known": len(harms), "drawn_harmful": sum(item >= 0.3 for item in harms)}
    rest = [at for _, at in checks if not at[0]["harmful"]]
    turned = sum(any(one["harmful"] or not one["ok"] for one in at) for at in rest)
    n, k = found["drawn_known"], found["drawn_harmful"]
    if run["drawn"] and n:
        high = bound(k, n, True)
        found |= {"share": k / n, "share_low": bound(k, n, False), "share_high": high}
        if run["drawn"] == "run" and rest:
            found["share_high_steps"] = high + (1 - high) * bound(turned, len(rest), True)
    sql.close()
    return found


def state(one: dict[str, Any]) -> tuple[Any, ...]:
    """Return what must be the same at each step."""
    return one["ok"], one["harmful"], one["conflict"] if one["harmful"] else ""


def stable(at: list[dict[str, Any]]) -> bool:
    """Return whether verdict and kind are the same at each step."""
    return len({state(one) for one in at}) == 1


def errors(at: list[dict[str, Any]], of: str) -> dict[str, Any] | None:
    """Return errors at dt: against dt/8, extrapolated (Richardson), and Roache's index."""
    some = {one["steps"]: one for one in at if one["ok"] and one["steps"] in (1, 2, 4, 8)}
    kinds = {one["conflict"] for one in some.values()}
    if len(some) < 4 or (of == "time" and (len(kinds) > 1 or kinds == {""})):
        return None
    q = [some[steps][of] for steps in (1, 2, 4, 8)]
    before, last = q[1] - q[2], q[2] - q[3]
    order = math.log2(before / last) if before * last > 0 else None
    power = order if order is not None and 0.5 <= order <= 2 else 0.0
    off = abs(q[0] - (q[3] - last / (2 ** (power or 1.0) - 1)))
    index = off * (1.25 if power else 3)
    return {"q": q, "error": abs(q[0] - q[3]), "order": order, "extrapolated": off, "gci": index}


def of_all(name: str, of: str, runs: list[dict[str, Any]], files: int) -> Any:
    """Return a figure of all runs by its definition."""
    checks = [at for run in runs for _, at in run["checks"]]
    part = name.rpartition("_")[2] if name.endswith(("_low", "_high")) else ""
    if name in SUMS:
        return sum(run[name] for run in runs)
    if name.startswith(("ran", "confirmed")):
        paths = [run["folder"] / f"confirmation-{of}.json" for run in runs]
        records = [json.loads(path.read_text("utf-8")) for path in paths if path.is_file()]
        there = [item["there"] for one in records for item in one["scenarios"] if item["there"]]
        k = sum(item["critical"] for item in there)
        return bound(k, len(there), part == "high") if part else len(there) if name == "ran" else k
    some = [at for at in checks if at[0]["harmful"] == (not name.startswith("sample"))]
    if name.startswith(("findings", "sample")):
        flips = sum(not stable(at) for at in some)
        if part:
            return bound(flips, len(some), part == "high")
        pairs = [state(at[0]) == state(one) for at in some for one in at if str(one["steps"]) == of]
        ways = {"flips": flips, "stable": len(some) - flips, "at": len(pairs), "kept": sum(pairs)}
        return ways.get(name.partition("_")[2], len(some))
    simple = {"runs": len(runs), "versions": len({run["version"] for run in runs}), "files": files,
              "checked": len(checks),
              "sensitivity": sum((run["folder"] / "sensitivity.json").is_file() for run in runs),
              "shares": sum("share" in run for run in runs),
              "combined": sum("share_high_steps" in run for run in runs)}  # fmt: skip
    if name in simple:
        return simple[name]
    made = [one for one in (errors(at, of) for at in some) if one is not None]
    same = sum(max(one["q"]) == min(one["q"]) for one in made)
    if name in ("series", "unchanged"):
        return len(made) if name == "series" else same
    kind, _, part = name.replace("orders", "order").partition("_")
    values = [one[kind] for one in made if one[kind] is not None]
    q95 = quantiles(values, n=20, method="inclusive")[18] if len(values) > 1 else sum(values)
    return {"median": median(values or [0]), "q95": q95}.get(part, len(values))


def check(base: Path) -> Iterator[tuple[str, Any, Any, bool | None]]:
    """Yield each claim, what the dossier states, what is found, and whether they agree."""
    dossier = json.loads((base / "credibility.json").read_text("utf-8"))
    for item in dossier["evidence"]:
        digest = hashlib.sha256((base / item["file"]).read_bytes()).hexdigest()
        yield f"SHA-256 {item['file']}", item["sha256"][:16], digest[:16], digest == item["sha256"]
    runs = {run["id"]: of_run(run, base / run["folder"]) for run in dossier["runs"]}
    texts = {item["id"]: item["text"] for item in dossier["numbers"]}
    for item in dossier["numbers"]:
        (owner, _, rest), stated, form = item["id"].partition("."), item["value"], item["form"]
        if (name := rest.partition(":")[0]) in OUTSIDE:
            yield item["id"], item["text"], f"not in the files; again: {item['again']}", None
            continue
        args = name, item["of"], [*runs.values()], len(dossier["evidence"])
        found = of_all(*args) if owner == "all" else runs[owner][name]
        near = isinstance(found, float) and math.isclose(found, stated, rel_tol=1e-9, abs_tol=1e-12)
        same = (near or found == stated) and item["text"] == written(stated, form)
        yield item["id"], item["text"], written(found, form), same
    for item in dossier["items"]:
        for said in (item["claim"], *item["details"]):
            made = re.sub(r"\{([\w.:-]+)\}", lambda m: texts.get(m[1], m[0]), said["template"])
            if said["template"] and made != said["text"]:
                yield f"text of {item['id']}", said["text"], made, False
        if item["status"] not in ("yours", "stated"):
            word = (
                "gap" if {*item["needs"]} - texts.keys() else "partly" if item["note"] else "filled"
            )
            yield f"status of {item['id']}", item["status"], word, item["status"] == word
    hang = {(name, row + 1) for name, run in runs.items() for row, at in run["checks"]
            if not stable(at)}  # fmt: skip
    listed = {(one["run"], one["evaluation"]) for one in dossier["flips"]}
    yield "hang on the time step", len(listed), len(hang), listed == hang


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
    print(f"\n{len(rows)} checks: {odd} differ, {rest} not recomputable from the files.")
    return int(odd > 0)


if __name__ == "__main__":
    sys.exit(main())
