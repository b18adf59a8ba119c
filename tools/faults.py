"""Inject faults into kernels, one at a time: does ``bridgegen credibility --validate`` see them?

    python tools/faults.py --write            # all of them, into the package's release.json
    python tools/faults.py --only pet-off     # some of them, printed only
    python tools/faults.py --random 30        # instead: changes of operators, drawn by chance

Each fault is a text of a file that another one replaces, in a copy of the package with a cache of
compiled code of its own: that of the unchanged package, in which code is kept by the content of
its source and of all that this imports, so that what a fault reaches is compiled anew and nothing
else. A text that is not there exactly once is refused, so that no fault rots. The list was written,
and committed, before the suite was: none was chosen because it is found. Whoever wrote the suite
knew the list, though; faults that are drawn by chance nobody knew.
"""

import argparse
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

PACKAGE = Path(__file__).parents[1] / "src" / "bridgegen"
RELEASE = PACKAGE / "jobs" / "credibility" / "release.json"
LONGEST = 1500  # s; a suite that takes longer hangs


class Fault(NamedTuple):
    """A fault: in a file of the package, a text and what replaces it."""

    name: str
    file: str
    text: str
    replaced: str
    what: str


METRICS, CONFLICT = "assess/metrics", "assess/conflict"
EMBEDDED = "simulation/embedded"

FAULTS = (
    Fault("box-swapped", "simulation/_box_kernels.py",
          "    la, wa = 0.5 * box_a[0], 0.5 * box_a[1]\n",
          "    la, wa = 0.5 * box_a[1], 0.5 * box_a[0]\n",
          "distance of boxes: length and width of the ego swapped"),
    Fault("ttc-sign", f"{METRICS}/_time_kernels.py",
          "        wx = vb[k] * cb - va[k] * ca\n", "        wx = vb[k] * cb + va[k] * ca\n",
          "time to collision: sign of the ego's velocity"),
    Fault("pet-off", f"{METRICS}/_time_kernels.py",
          "                        best = abs(j - i)\n",
          "                        best = abs(j - i) + 1\n",
          "post-encroachment time: off by one step"),
    Fault("brake-half", f"{METRICS}/_brake_kernels.py",
          "        return v * v / (2.0 * s)  # it has stopped by then\n",
          "        return v * v / s\n",
          "braking threat: v² / s for v² / 2s"),
    Fault("rss-response", f"{METRICS}/_kernels.py",
          "    after = v + response * accel\n", "    after = v\n",
          "RSS: no acceleration during the response time"),
    Fault("merge-boundary", f"{METRICS}/_kernels.py",
          "k - last > merge_steps:", "k - last >= merge_steps:",
          "collisions: < for <= where two contacts are one"),
    Fault("red-off", f"{METRICS}/_kernels.py",
          "state = lights[i, light, k - 1]", "state = lights[i, light, k]",
          "red lights: the state one step late"),
    Fault("masses-swapped", f"{CONFLICT}/_severity_kernels.py",
          "    return mine / total, its / total\n", "    return its / total, mine / total\n",
          "severity: each party gets the other's share of the closing speed"),
    Fault("no-tangential", f"{CONFLICT}/_severity_kernels.py",
          "    return elementary.hypot(normal, slides)\n", "    return normal\n",
          "severity: friction of the surfaces ignored"),
    Fault("reaction", f"{CONFLICT}/_careful_driver_kernels.py",
          "            elif (m - start) * dt > REACTION + 1e-9:\n"
          "                rises = min((m - start) * dt - REACTION, dt)\n",
          "            elif m > start:\n                rises = dt\n",
          "careful driver of the verdict: no reaction time"),
    Fault("wet-road", f"{CONFLICT}/_careful_driver_kernels.py",
          "min(slowed + JERK * rises, braking, gives(scene, a, i, speed))",
          "min(slowed + JERK * rises, braking)",
          "careful driver of the verdict: friction of the road ignored"),
    Fault("head-on", f"{CONFLICT}/_type_kernels.py",
          "    return HEAD_ON if cosine <= -SAME_WAY else CROSSING\n",
          "    return HEAD_ON if cosine <= SAME_WAY else CROSSING\n",
          "type: crossing traffic is called head-on"),
    Fault("right-of-way", f"{CONFLICT}/_responsibility_kernels.py",
          "scene.c[0, j] * scene.s[e, j] - scene.s[0, j] * scene.c[e, j] > 0.0",
          "scene.c[0, j] * scene.s[e, j] - scene.s[0, j] * scene.c[e, j] < 0.0",
          "responsibility: left before right"),
    Fault("in-hand", f"{CONFLICT}/_conflict_kernels.py",
          "needed <= (v[k - 1] - v[k]) / dt", "needed <= (v[k] - v[k - 1]) / dt",
          "near miss: sign of the ego's own braking"),
    Fault("shared-fault", f"{CONFLICT}/_conflict_kernels.py",
          "    return responsible in (EGO, SHARED) or (", "    return responsible == EGO or (",
          "failure: shared responsibility does not count"),
    Fault("euler", f"{EMBEDDED}/_motion_kernels.py",
          "    travelled = 0.5 * (v + end) * dt\n", "    travelled = end * dt\n",
          "motion: Euler's rule for the trapezoidal one"),
    Fault("friction-unit", f"{EMBEDDED}/_motion_kernels.py",
          "    total = elementary.hypot(a + uphill, v * v * bend + aside)\n",
          "    total = elementary.hypot(a + uphill, v * bend + aside)\n",
          "motion: v for v² in the friction circle"),
    Fault("limits-swapped", f"{EMBEDDED}/_motion_kernels.py",
          "    a = min(max(demanded, -limits[2] - uphill), limits[1] - uphill)\n",
          "    a = min(max(demanded, -limits[1] - uphill), limits[2] - uphill)\n",
          "motion: limits of acceleration and deceleration swapped"),
    Fault("lane-rate", f"{EMBEDDED}/motion/_lateral_kernels.py",
          "        steepest = 1.5\n", "        steepest = 1.0\n",
          "change of lane by a rate: the mean for the steepest"),
    Fault("speed-rate", f"{EMBEDDED}/motion/_speed_kernels.py",
          "        state.rate[e] = min(abs(value), most)\n",
          "        state.rate[e] = max(abs(value), most)\n",
          "change of speed by a rate: max for min"),
    Fault("delay", f"{EMBEDDED}/conditions/_trigger_kernels.py",
          "    edge, j = conditions[c, EDGE], k - conditions[c, DELAY]\n",
          "    edge, j = conditions[c, EDGE], k - conditions[c, DELAY] - 1\n",
          "triggers: one step late"),
    Fault("un-r157-reaction", "drivers/_un_r157_kernels.py",
          "dt + 1e-9 >= CAREFUL_REACTION:", "dt + 1e-9 >= 0.5 * CAREFUL_REACTION:",
          "driver un-r157: half the reaction time"),
    Fault("fsm-sign", "drivers/_fsm_kernels.py",
          "(2.0 * COMFORT_BRAKING) - leader_stops + SAFE_MARGIN",
          "(2.0 * COMFORT_BRAKING) + leader_stops + SAFE_MARGIN",
          "driver fsm: sign of the leader's stopping distance"),
    Fault("idm", "drivers/_following_kernels.py",
          "(v - leader_speed) / (2.0 * math.sqrt(", "(v - leader_speed) / (math.sqrt(",
          "following: factor of 2 in the intelligent driver model"),
    Fault("yellow", "drivers/_lights_kernels.py",
          "at_line > YELLOW_DECELERATION:", "at_line < YELLOW_DECELERATION:",
          "drivers at yellow: those that could stop pass"),
    Fault("left-right", "drivers/_path_kernels.py",
          "        d = py * c - px * t\n", "        d = px * t - py * c\n",
          "paths: right is left"),
    Fault("bend-side", "drivers/_speed_kernels.py",
          "        bend = abs(path[i, CURVATURE])\n", "        bend = path[i, CURVATURE]\n",
          "drivers in bends: right bends ignored"),
    Fault("grip", "drivers/_weather_kernels.py",
          "    weather[FRICTION] = GRIP * weather[FRICTION_SCALE]\n",
          "    weather[FRICTION] = GRIP\n",
          "weather: friction of a wet road ignored"),
    Fault("wrap", "drivers/_tracking_kernels.py",
          "    turn -= 2.0 * math.pi * math.floor(turn / (2.0 * math.pi) + 0.5)\n", "",
          "tracking: headings are not taken modulo 2π"),
    Fault("others-reaction", "drivers/_attentive_kernels.py",
          "dt + 1e-9 >= CAREFUL_REACTION:", "dt + 1e-9 >= 2.0 * CAREFUL_REACTION:",
          "attentive traffic: twice the reaction time"),
)  # fmt: skip


OPERATORS = (
    (" + ", " - "), (" - ", " + "), (" * ", " / "), (" < ", " <= "), (" >= ", " > "),
    (" <= ", " < "), (" > ", " >= "), ("max(", "min("), ("min(", "max("),
    (" and ", " or "), (" == ", " != "),
    (" 0.5 ", " 1.0 "), ("not ", ""),
)  # fmt: skip
"""What a fault that is drawn by chance changes, as mutation testing does."""


def drawn(n: int, seed: int) -> list[Fault]:
    """Return faults by chance: an operator in a line of a kernel that verdicts rest on."""
    paths = [
        path
        for room in ("assess", "simulation", "drivers")
        for path in sorted((PACKAGE / room).rglob("_*_kernels.py"))
    ]
    places = []
    for path in paths:
        text = re.sub(
            r'""".*?"""', lambda m: re.sub(r"[^\n]", "#", m[0]), path.read_text(), flags=re.S
        )
        lines = path.read_text().splitlines(keepends=True)
        for line, code in zip(lines, text.splitlines(keepends=True), strict=True):
            code = code.partition("#")[0]
            if lines.count(line) == 1 and not re.match(
                r"(@|def |from |import |[A-Z_, ]+ = )", line
            ):
                places += [(path, line, *pair) for pair in OPERATORS if code.count(pair[0]) == 1]
    found = random.Random(seed).sample(places, n)
    return [
        Fault(f"random-{k}", path.relative_to(PACKAGE).as_posix(), line, line.replace(old, new),
              f"{path.stem}: `{line.strip()}`: `{old.strip()}` becomes `{new.strip()}`")
        for k, (path, line, old, new) in enumerate(found, start=1)
    ]  # fmt: skip


def inject(fault: Fault, package: Path) -> None:
    """Change a copy of the package; refuse a text that is not there exactly once."""
    path = package / fault.file
    text = path.read_text("utf-8")
    if text.count(fault.text) != 1:
        raise SystemExit(f"{fault.name}: {text.count(fault.text)} times in {fault.file}, must be 1")
    path.write_text(text.replace(fault.text, fault.replaced), "utf-8")


SUITE = """
import json, sys
import bridgegen
from bridgegen.jobs.credibility.validation import every_case, result_of
print(bridgegen.__file__, flush=True)
def cost(case):
    return case.kind == "bits", case.id in ("D2", "E3", "L2")  # those that simulate
for case in sorted(every_case(), key=cost):
    found = result_of(case)
    if not found["passed"]:
        print(json.dumps([case.id, case.kind]))
        sys.exit(3)
"""
"""The cases of ``credibility --validate`` up to the first that fails, known answers and laws before
bits: one turns the dossier red, and whether later ones do, too, costs minutes of compiling."""


def first_failure(place: Path) -> tuple[str, str]:
    """Return the first case that fails in the copy in a folder, and its kind; "" if none does."""
    env = os.environ | {"PYTHONPATH": str(place), "NUMBA_CACHE_DIR": str(place / "cache")}
    given: dict[str, Any] = {"cwd": place, "env": env, "capture_output": True, "text": True}
    try:
        done = subprocess.run([sys.executable, "-c", SUITE], timeout=LONGEST, **given)
    except subprocess.TimeoutExpired:
        return "hangs", "end"
    file, *more = done.stdout.splitlines() or [""]
    if not file.startswith(str(place)):
        raise SystemExit(f"another package was run than the copy: {file!r} {done.stderr[-2000:]}")
    if done.returncode == 3:
        case, kind = json.loads(more[-1])
        return case, kind
    return ("", "") if done.returncode == 0 else (f"ends with {done.returncode}", "end")


def copied(base: Path) -> Path:
    """Return a folder with a copy of the package, and of a cache if there is one."""
    place = Path(tempfile.mkdtemp(prefix="bridgegen-fault-"))
    shutil.copytree(PACKAGE, place / "bridgegen", ignore=shutil.ignore_patterns("__pycache__"))
    if base != place and (base / "cache").is_dir():
        shutil.copytree(base / "cache", place / "cache")
    return place


def see(fault: Fault, base: Path) -> dict[str, str]:
    """Inject a fault; return which case sees it first, and its kind."""
    began, place = time.monotonic(), copied(base)
    try:
        inject(fault, place / "bridgegen")
        case, kind = first_failure(place)
    finally:
        shutil.rmtree(place, ignore_errors=True)
    took = f"{time.monotonic() - began:>5.0f} s"
    print(f"{fault.name:<18}{case or 'MISSED':<10}{kind:<8}{took}  {fault.what}", flush=True)
    return {"name": fault.name, "what": fault.what, "case": case, "kind": kind}


def main() -> None:
    """Print, or write, which faults are seen, and by which kind of case."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="*", help="names of faults")
    parser.add_argument("--random", type=int, default=0, help="draw so many faults by chance")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--base", type=Path, help="a folder whose compiled code is kept and used")
    parser.add_argument("--write", action="store_true", help="into the package's release.json")
    options = parser.parse_args()
    faults = drawn(options.random, options.seed) if options.random else list(FAULTS)
    faults = [fault for fault in faults if not options.only or fault.name in options.only]
    for fault in faults:
        assert (PACKAGE / fault.file).read_text("utf-8").count(fault.text) == 1, fault.name
    base = copied(options.base or Path("none"))
    try:
        began = time.monotonic()
        if any(found := first_failure(base)):
            raise SystemExit(f"the suite does not pass without a fault: {found}")
        print(f"without a fault it passes, in {time.monotonic() - began:.0f} s", flush=True)
        if options.base:
            shutil.copytree(base / "cache", options.base / "cache", dirs_exist_ok=True)
        with ThreadPoolExecutor(2) as pool:
            rows = list(pool.map(lambda fault: see(fault, base), faults))
    finally:
        shutil.rmtree(base, ignore_errors=True)
    seen = [row["kind"] for row in rows if row["kind"]]
    known = sum(kind != "bits" for kind in seen)
    print(f"{len(seen)} of {len(rows)} seen, {known} of them without the published bits")
    if options.write:
        release = json.loads(RELEASE.read_text("utf-8")) if RELEASE.is_file() else {}
        key = "random_faults" if options.random else "faults"
        known_rows = {row["name"]: row for row in (*release.get(key, ()), *rows)}
        order = {fault.name: number for number, fault in enumerate(FAULTS)}
        release[key] = sorted(known_rows.values(), key=lambda row: order.get(row["name"], 0))
        RELEASE.write_text(json.dumps(release, indent=1, ensure_ascii=False) + "\n", "utf-8")


if __name__ == "__main__":
    main()
