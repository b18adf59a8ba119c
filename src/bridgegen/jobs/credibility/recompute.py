"""Recompute every figure of a credibility dossier: python recompute.py [FOLDER of the JSON file].

Needs Python 3.11 alone. Exit status 1: something differs; 2: a file cannot be read.
"""

import hashlib
import json
import math
import re
import runpy
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
OUTSIDE = (
    "bits_compared",
    "bits_different",
    "installed",
    "known_faults",
    "mutants",
    "mutants_seen",
    "mutants_known",
    "random",
    "random_seen",
    "random_known",
)  # not in files


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
    low, high, target = 0.0, 1.0, 0.975 if upper else 0.025
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if tail(k + upper, n, middle) < target else (low, middle)
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
    info = sql.execute("PRAGMA table_info(evaluations)")  # id, batch, seconds, u, parameters, …
    names = ['"' + item[1].replace('"', '""') + '"' for item in info]
    column = dict(zip(about["metrics"], names[4 + len(about["parameters"]) :], strict=False))
    harm = column["harm" if run["count"] == "ego" else "harm_any"]
    cause, distribution = (about["settings"].get(name) for name in ("cause", "distribution"))

    def ask(what: str, where: str) -> Any:
        return sql.execute(f"SELECT {what} FROM evaluations WHERE {where}").fetchone()[0]

    triage = json.loads((folder / "triage.json").read_text("utf-8"))
    checks = [(item["evaluation"], item["at"]) for item in triage.get("step_checks", [])]
    for item in triage.get("step_checks", []):
        item["at"][0]["finest"] = item["time_step"] / 8
    where = {"evaluations": "1", "drawn": "1", "failed": "status != 0", "drawn_known": FIT}
    where |= {"drawn_harmful": f"{FIT} AND {harm} >= 0.3{' AND critical' * bool(cause)}"}
    found = {name: ask("count(*)", text) for name, text in where.items()}
    found["same"] = sum(ask(harm, f"id = {row:d}") == at[0]["harm"] for row, at in checks)
    found |= {"folder": folder, "version": about["version"], "checks": checks, "runs": 1}
    fits = [p.read_bytes().find(b"\n  parameterisation:") > 0 for p in folder.glob("exposure.yaml")]
    found |= {"checked": len(checks), "distributions": distribution is not None}
    found |= {"sensitivity": (folder / "sensitivity.json").is_file(), "recorded": any(fits)}
    edges = [names[4 + about["parameters"].index(name)] for name in run["edges"]]
    rows = sql.execute(f"SELECT {', '.join(edges) or 1} FROM evaluations WHERE status = 0")
    inside = {tuple(map(bisect_right, run["edges"].values(), row)) for row in rows}
    found["bins_all"] = sum(len(inner) + 1 for inner in run["edges"].values())
    found["bins_evaluated"] = sum(len({*some}) for some in zip(*inside, strict=True))
    if run["drawn"] == "fresh":
        harms = [item for item in triage["fresh"]["harm"] if item is not None]
        found |= {"drawn": len(triage["fresh"]["harm"]), "drawn_known": len(harms)}
        found["drawn_harmful"] = sum(item >= 0.3 for item in harms)
    rest = [at for _, at in checks if not at[0]["harmful"]]
    turned = sum(any(one["harmful"] or not one["ok"] for one in at) for at in rest)
    if run["drawn"] and (n := found["drawn_known"]):
        low, high = (bound(found["drawn_harmful"], n, upper) for upper in (False, True))
        found |= {"share": found["drawn_harmful"] / n, "share_low": low, "share_high": high}
        if run["drawn"] == "run" and rest:
            found["share_high_steps"] = high + (1 - high) * bound(turned, len(rest), True)
    return found | {"shares": "share" in found, "combined": "share_high_steps" in found}


def state(one: dict[str, Any]) -> tuple[Any, ...]:
    """Return what must be the same at each step."""
    return one["ok"], one["harmful"], one["conflict"] if one["harmful"] else ""


def errors(at: list[dict[str, Any]], of: str) -> dict[str, Any] | None:
    """Return errors at dt: against dt/8, extrapolated (Richardson), Roache's index, stated."""
    some = {one["steps"]: one for one in at if one["ok"] and one["steps"] in (1, 2, 4, 8)}
    kinds = {one["conflict"] for one in some.values()}
    q: list[Any] = [some[steps].get(of) for steps in sorted(some)]
    if of in ("time", "place", "speed") and (len(kinds) > 1 or kinds == {""}):
        return None
    if len(q) < 4 or None in q:
        return None
    q = [complex(*one) if of == "place" else one for one in q]
    before, last = q[1] - q[2], q[2] - q[3]
    on = (before * last.conjugate()).real > 0
    order = math.log2(abs(before) / abs(last)) if on else None
    power = order if order is not None and 0.5 <= order <= 2 else 0
    off = abs(q[0] - (q[3] - last / (2 ** (power or 1) - 1)))
    found = {"error": abs(q[0] - q[3]), "extrapolated": off, "gci": off * (1.25 if power else 3)}
    fine = at[0]["finest"] * {"time": 1, "place": at[0].get("speed") or 0}.get(of, 0)
    found["stated"] = 1.25 * max(abs(a - b) for a in q for b in q) + fine
    return found | {"q": q, "order": order}


def suite(name: str, base: Path) -> int:
    """Return how many cases the validation suite has, or how many of a kind fail."""
    cases = json.loads((base / "validation.json").read_text("utf-8"))["results"]
    of = {"cases_wrong": ("answer", "law"), "cases_bits": ("bits",)}.get(name)
    if of is None:
        return len(cases)

    def differs(at: dict[str, Any]) -> bool:
        pair = at["expected"], at["found"]
        near = str not in map(type, pair) and abs(pair[0] - pair[1]) <= at["tolerance"]
        return not (near or pair[0] == pair[1])

    failed = [one for one in cases if not one["checks"] or any(map(differs, one["checks"]))]
    return sum(one["kind"] in of for one in failed)


def of_all(name: str, of: str, runs: list[dict[str, Any]], files: int) -> Any:
    """Return a figure of all runs by its definition."""
    checks = [at for run in runs for _, at in run["checks"]]
    part = name.rpartition("_")[2] if name.endswith(("_low", "_high")) else ""
    if all(isinstance(run.get(name), int) for run in runs):
        return sum(run[name] for run in runs)
    if name.startswith(("ran", "confirmed")):
        paths = [run["folder"] / f"confirmation-{of}.json" for run in runs]
        records = [json.loads(path.read_text("utf-8")) for path in paths if path.is_file()]
        ran = [item["there"] for one in records for item in one["scenarios"] if item["there"]]
        k = len(ran) if name == "ran" else sum(item["critical"] for item in ran)
        return bound(k, len(ran), part == "high") if part else k
    some = [at for at in checks if at[0]["harmful"] == (not name.startswith("sample"))]
    if name.startswith(("findings", "sample")):
        flips, n = sum(len({*map(state, at)}) > 1 for at in some), len(some)
        pairs = [state(at[0]) == state(one) for at in some for one in at if str(one["steps"]) == of]
        ways = {"flips": flips, "stable": len(some) - flips, "at": len(pairs), "kept": sum(pairs)}
        return bound(flips, n, part == "high") if part else ways.get(name.partition("_")[2], n)
    if name in ("files", "versions"):
        return files if name == "files" else len({run["version"] for run in runs})
    made = [one for one in (errors(at, of) for at in some) if one is not None]
    if name == "unchanged":
        return sum(len(set(one["q"])) == 1 for one in made)
    kind, _, part = {"orders": "order", "series": "q"}.get(name, name).partition("_")
    values = [one[kind] for one in made if one[kind] is not None]
    if part == "q95":
        return quantiles(values, n=20, method="inclusive")[18] if values[1:] else values[0]
    return median(values) if part else len(values)


def check(base: Path) -> Iterator[tuple[str, Any, Any, bool | None]]:
    """Yield each claim, what the dossier states, what is found, and whether they agree."""
    dossier = json.loads((base / "credibility.json").read_text("utf-8"))
    for item in dossier["evidence"]:
        digest = hashlib.sha256((base / item["file"]).read_bytes()).hexdigest()
        yield f"SHA-256 {item['file']}", item["sha256"][:16], digest[:16], digest == item["sha256"]
    runs = {run["id"]: of_run(run, base / run["folder"]) for run in dossier["runs"]}
    texts = {item["id"]: item["text"] for item in dossier["numbers"]}
    elsewhere = ("measured.csv", "validated.json")  # their figures: recompute_real.py
    for item in [one for one in dossier["numbers"] if one["source"] not in elsewhere]:
        (owner, _, rest), stated, form = item["id"].partition("."), item["value"], item["form"]
        if (name := rest.partition(":")[0]) in OUTSIDE:
            yield item["id"], item["text"], f"not in the files; again: {item['again']}", None
            continue
        args = name, item["of"], [*runs.values()], len(dossier["evidence"])
        if name.startswith("cases"):
            found = suite(name, base)
        else:
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
            word = "gap" if {*item["needs"]} - {*texts} else "partly" if item["note"] else "filled"
            yield f"status of {item['id']}", item["status"], word, item["status"] == word
    hang = {(name, row + 1) for name, run in runs.items() for row, at in run["checks"]
            if len({*map(state, at)}) > 1}  # fmt: skip
    listed = {(one["run"], one["evaluation"]) for one in dossier["flips"]}
    yield "hang on the time step", len(listed), len(hang), listed == hang
    script = str(Path(__file__).with_name("recompute_real.py"))
    yield from runpy.run_path(script)["check"](base, dossier, written)


def main() -> int:
    """Print the table; return the exit status."""
    base = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    try:
        rows = list(check(base))
    except (OSError, ValueError, LookupError, TypeError, sqlite3.Error) as error:
        print(f"{base}: cannot be checked: {type(error).__name__}: {error}", file=sys.stderr)
        return 2
    for name, stated, found, same in rows:
        word = {None: "-", True: "agrees", False: "DIFFERS"}[same]
        print(f"{word:<8}{name:<32}{stated!s:.60} | {found!s:.60}")
    odd, rest = (sum(row[3] is kind for row in rows) for kind in (False, None))
    print(f"\n{len(rows)} checks: {odd} differ, {rest} not recomputable from the files.")
    return int(odd > 0)


if __name__ == "__main__":
    sys.exit(main())
