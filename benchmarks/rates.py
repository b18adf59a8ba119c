"""How fast a pipeline evaluates, in wall time and in processor time."""

import os
import time
from dataclasses import dataclass

from bridgegen.base.arrays import Float
from bridgegen.engine.pipeline import Pipeline


@dataclass(frozen=True)
class Rate:
    """Of an evaluation, rollout, metrics and objective.

    Attributes:
        per_second: scenarios in a second of wall time, on all cores.
        cpu_seconds: processor time of one scenario [s], the driver's processes included; other
            work on the machine hardly touches it.
    """

    per_second: float
    cpu_seconds: float


def rate_of(pipeline: Pipeline, X: Float, times: int = 3) -> Rate:
    """Return the best of several evaluations of the same rows, after one of a few."""
    pipeline.evaluate(X[: min(len(X), 64)])
    walls, cpus = [], []
    for _ in range(times):
        wall, cpu = time.perf_counter(), processor_time()
        pipeline.evaluate(X)
        walls.append(time.perf_counter() - wall)
        cpus.append(processor_time() - cpu)
    return Rate(len(X) / min(walls), min(cpus) / len(X))


def processor_time() -> float:
    """Return the processor time of this process and of its living children [s]."""
    return time.process_time() + sum(map(_time_of, _children()))


def _children() -> list[str]:
    """Return the processes that this one has begun; none where the system has no /proc."""
    if not os.path.isdir("/proc"):
        return []
    mine = str(os.getpid())
    return [one for one in os.listdir("/proc") if one.isdigit() and _parent_of(one) == mine]


def _stat(process: str) -> list[str]:
    try:
        with open(f"/proc/{process}/stat", encoding="utf-8") as file:
            return file.read().rsplit(")", 1)[1].split()
    except OSError:  # it has just ended
        return []


def _parent_of(process: str) -> str:
    fields = _stat(process)
    return fields[1] if fields else ""


def _time_of(process: str) -> float:
    fields = _stat(process)
    ticks = float(os.sysconf("SC_CLK_TCK"))
    return (int(fields[11]) + int(fields[12])) / ticks if fields else 0.0
