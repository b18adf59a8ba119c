"""Compiled code that a wheel carries: read, never written, where this machine can run it.

A wheel without it, or on a machine that lacks an instruction of its baseline, compiles as always.
"""

import json
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numba
from llvmlite import binding as llvm

from bridgegen.base.compilation.sources import PACKAGE

FOLDER = PACKAGE / "_kernels"
BASELINE = "x86-64-v3"
"""The processors of 2013 (Intel Haswell) and 2015 (AMD Excavator), and later ones."""

FEATURES = (
    "avx", "avx2", "bmi", "bmi2", "cmov", "crc32", "cx16", "cx8", "f16c", "fma", "fxsr", "lzcnt",
    "mmx", "movbe", "popcnt", "sahf", "sse", "sse2", "sse3", "sse4.1", "sse4.2", "ssse3", "xsave",
)  # fmt: skip
"""Its instructions, as LLVM names them. Source: x86-64 psABI, micro-architecture levels."""


@dataclass(frozen=True)
class Shipped:
    """The compiled code of a wheel.

    Attributes:
        folder: it lies there as in the cache.
        machine: for which it was compiled, as Numba writes it: triple, processor, features.
    """

    folder: Path
    machine: tuple[str, str, str]


def described() -> dict[str, str]:
    """Return what must be the same where code of this process is to be used."""
    python = f"{sys.implementation.cache_tag}"
    return {"python": python, "numba": numba.__version__, "triple": llvm.get_process_triple()}


def features() -> str:
    """Return the baseline's instructions as LLVM wants them."""
    return ",".join(f"+{one}" for one in FEATURES)


@cache
def shipped() -> Shipped | None:
    """Return the code that came with this installation, if this machine can run it."""
    try:
        facts = json.loads((FOLDER / "machine.json").read_text("utf-8"))
        has = llvm.get_host_cpu_features()
    except (OSError, ValueError, RuntimeError):
        return None
    if facts != described() or not all(has.get(one) for one in FEATURES):
        return None
    return Shipped(FOLDER, (facts["triple"], BASELINE, features()))
