"""How fast rows are on a GPU; each part in a process of its own, with a limit of time.

    .venv/bin/python -m benchmarks.gpu          # three minutes at most, once it is compiled
    .venv/bin/python -m benchmarks.gpu --host   # its PTX on this processor: bits, and no times

A part that fails or takes too long says so, and the others are measured.
"""

import gzip
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from bridgegen.assess.conflict._measure_kernels import IOU, MEASURED
from bridgegen.base import cuda
from bridgegen.base.cuda import DEVICE
from bridgegen.base.errors import BridgeGenError
from bridgegen.engine.judged import judge
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.embedded import device

ALL = 170
"""Time for all parts [s]; what is left of it is the limit of each."""

ROWS = 2**18
CROWD = Path(__file__).with_name("crowd.yaml")


def module() -> str:
    """Load the module; the driver compiles it, and keeps it."""
    ptx, packed = gzip.decompress(device.PATH.read_bytes()), device.PATH.stat().st_size
    clock = time.perf_counter()
    name = device.current().name
    seconds = time.perf_counter() - clock
    return f"{name}; loaded in {seconds:.1f} s; PTX {len(ptx):,} B, {packed:,} B packed"


def judged(name: str, ego: str, rows: int = ROWS, *, perceives: bool = False) -> str:
    """Judge rows and measure all metrics: states are made of values, and verdicts come back."""
    scenario = load(name)
    pipeline = Pipeline(scenario, scenario.space(), PipelineOptions(ego=ego))
    runner, space = pipeline.runner, pipeline.space
    X = space.decode(np.random.default_rng(0).random((rows, space.n_var)))
    metrics = MEASURED if perceives else MEASURED[:IOU]
    judge(runner, X[:1024], violations=True, metrics=metrics)
    clock = time.perf_counter()
    found = judge(runner, X, violations=True, metrics=metrics)
    seconds = time.perf_counter() - clock
    assert found is not None
    agents = len(runner.embedded.program.names)
    steps = int(found.n_steps.sum()) * agents
    return f"{rows / seconds:,.0f} rows/s, {steps / seconds:,.0f} agent-steps/s ({agents} agents)"


def command(*words: str) -> str:
    """Run a command on the device."""
    with tempfile.TemporaryDirectory() as folder:
        line = [*words, "--device", "cuda", "--out", str(Path(folder) / "out")]
        clock = time.perf_counter()
        subprocess.run(["bridgegen", *line], check=True, capture_output=True)
        return f"{time.perf_counter() - clock:.1f} s"


RISK = (
    *("risk", "crossroads-s4", "--ego", "careful", "--exposure", "uniform", "--method", "mc"),
    *("--precision", "0.13", "--budget", "1000000000"),
)
MAP = (
    *("preventability", "cut-in", "--ego", "reference", "--grid", "gap=5:60:1000"),
    *("--grid", "ego_speed=10:40:1000"),
)

PARTS: dict[str, Callable[[], str]] = {
    "module": module,
    "crossroads-s4, route-follower": lambda: judged("crossroads-s4", "route-follower"),
    "crossroads-s4, reference": lambda: judged("crossroads-s4", "reference", perceives=True),
    "32 reactive participants": lambda: judged(str(CROWD), "route-follower", 2**15),
    " ".join(RISK): lambda: command(*RISK),
    " ".join(MAP): lambda: command(*MAP),
}


def on_host() -> None:
    """Run the PTX on this processor, and compare bits."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "tools"))
    import ptx

    cuda.library = ptx.Driver
    for ego in ("route-follower", "reference"):
        scenario = load("crossroads-s4")
        pipeline = Pipeline(scenario, scenario.space(), PipelineOptions(ego=ego))
        space = pipeline.space
        X = space.decode(np.random.default_rng(0).random((16, space.n_var)))
        rollouts = []
        for name in ("", "cuda"):
            os.environ[DEVICE] = name
            rollouts.append(pipeline.runner.run(X))
        here, there = rollouts
        same = all(
            getattr(here, field).tobytes() == getattr(there, field).tobytes()
            for field in ("x", "y", "h", "v", "a", "offset", "n_steps", "status", "detections")
        )
        print(f"crossroads-s4, {ego}: {'the same bits' if same else 'OTHER BITS'}")


def main() -> None:
    if "--host" in sys.argv:
        on_host()
        return
    os.environ[DEVICE] = "cuda"
    if len(sys.argv) > 1:
        print(PARTS[sys.argv[1]]())
        return
    try:
        cuda.library()
    except BridgeGenError as error:
        sys.exit(str(error))
    end = time.monotonic() + ALL
    for name in PARTS:
        line = [sys.executable, "-m", "benchmarks.gpu", name]
        try:
            left = max(end - time.monotonic(), 1.0)
            done = subprocess.run(line, capture_output=True, text=True, timeout=left)
        except subprocess.TimeoutExpired:
            print(f"{name}: not within the {ALL} s of all parts")
            continue
        said = (done.stdout if done.returncode == 0 else done.stderr).strip().splitlines()
        print(f"{name}: {said[-1] if said else f'exit status {done.returncode}'}", flush=True)


if __name__ == "__main__":
    main()
