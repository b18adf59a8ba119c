"""How fast rows are on a GPU; each part in a process of its own, with a limit of time.

    .venv/bin/python -m benchmarks.gpu            # on a machine with a GPU, three minutes at most
    .venv/bin/python -m benchmarks.gpu --host     # the module's PTX on this processor: bits, no times

A part that fails, or takes too long, says so; the others are measured.
"""

import gzip
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from bridgegen.engine.judged import judge
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.embedded import device

SECONDS = 60
"""Time limit of a part; the first one waits for the driver's compilation."""

ROWS = 2**17


def pipeline_of(name: str, ego: str) -> Pipeline:
    scenario = load(name)
    return Pipeline(scenario, scenario.space(), PipelineOptions(ego=ego))


def module() -> str:
    """Load the module; the driver compiles it, once."""
    clock = time.perf_counter()
    name = device.current()._gpu.name
    ptx = gzip.decompress(device.PATH.read_bytes())
    sizes = f"PTX {len(ptx):,} B, {device.PATH.stat().st_size:,} packed"
    return f"{name}; {sizes}; loaded in {time.perf_counter() - clock:.1f} s"


def verdicts(name: str, ego: str) -> str:
    """Return how many rows are judged in a second, made of their parameter values on the host."""
    pipeline = pipeline_of(name, ego)
    X = pipeline.space.decode(np.random.default_rng(0).random((ROWS, pipeline.space.n_var)))
    judge(pipeline.runner, X[:1024])
    clock = time.perf_counter()
    judged = judge(pipeline.runner, X)
    seconds = time.perf_counter() - clock
    assert judged is not None
    steps = judged.steps.sum() * len(pipeline.runner.embedded.program.names)
    return f"{len(X) / seconds:,.0f} rows/s, {steps / seconds:,.0f} agent-steps/s"


def command(*words: str) -> str:
    """Return how long a command takes, with the device."""
    with tempfile.TemporaryDirectory() as folder:
        out = str(Path(folder) / "out")
        line = [sys.executable, "-m", "bridgegen", *words, "--device", "cuda", "--out", out]
        clock = time.perf_counter()
        subprocess.run(line, check=True, capture_output=True, timeout=SECONDS)
        return f"{time.perf_counter() - clock:.1f} s: bridgegen {' '.join(words)}"
