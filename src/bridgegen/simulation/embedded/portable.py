"""A storyboard as the module of all kernels takes it, which runs elsewhere: in a browser.

The module (`tools/portable.py`) is the same for all storyboards: what it simulates lies in tables
that its host, ``simulator.js``, puts into its memory. This makes them of a batch, and says how a
row's state follows from its parameter values.
"""

import ast
import hashlib
import zlib
from base64 import b64encode
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bridgegen.base._elementary_kernels import FUNCTIONS
from bridgegen.base.compilation.folder import PACKAGE, with_imported
from bridgegen.base.errors import InputError
from bridgegen.drivers import STORYBOARD, get
from bridgegen.drivers._weather_columns import FRICTION
from bridgegen.openx.openscenario.values import Expr, ParameterRef, Value
from bridgegen.simulation.embedded import device
from bridgegen.simulation.embedded.addresses import FIELDS
from bridgegen.simulation.embedded.drivers import DEMANDS
from bridgegen.simulation.embedded.places.network import Network
from bridgegen.simulation.embedded.program import Program

if TYPE_CHECKING:
    from bridgegen.simulation.embedded.batch import Batch

UNSET = ("x", "y", "h", "v", "a", "offset", "lights")
"""Arrays of `Record` that hold anything before a row runs."""

MODULE = PACKAGE / "pages" / "web" / "kernels.wasm"
"""The module of all kernels."""


@cache
def sources() -> str:
    """Return the digest of what the module is made of: code, not comments and not docstrings."""
    found = hashlib.sha256()
    here = Path(__file__)
    entries = [here.with_name(name) for name in ("_rollout_kernels.py", "addresses.py")]
    judging = ("_judge_kernels.py", "_measure_kernels.py")
    entries += [PACKAGE / "assess" / "conflict" / name for name in judging]
    for path in sorted(with_imported(entries)):
        found.update(_code_of(path))
    return found.hexdigest()[:16]


def _code_of(path: Path) -> bytes:
    """Return the code of a file, without comments and docstrings."""
    tree = ast.parse(path.read_text("utf-8"))
    for node in ast.walk(tree):
        if isinstance(body := getattr(node, "body", None), list):
            node.body = [  # type: ignore[attr-defined]
                part
                for part in body
                if not (isinstance(part, ast.Expr) and isinstance(part.value, ast.Constant))
            ]
    return ast.dump(tree).encode()


def device_sources() -> str:
    """Return the same of the module for a GPU."""
    found = hashlib.sha256(sources().encode())
    found.update(_code_of(PACKAGE / "engine" / "_device_kernels.py"))
    laid = (device.JOB, device.INTERLEAVED, device.Given._fields, device.Found._fields)
    found.update(repr(laid).encode())
    return found.hexdigest()[:16]


def tables(
    program: Program, roads: Network, network: int = 0, **more: NamedTuple
) -> dict[str, Any]:
    """Return what the module's host needs to simulate rows of a storyboard, as JSON has it.

    "plan", "roads", "state", "record": bundles, each a list of ``[name, number, is float]`` and,
    for arrays, ``[name, type, shape, at]``: their content begins at that byte of "data" (deflated,
    in base64), or is zeros, where it is −1. "slots": numbers, and formulas (`Expression.as_json`).

    Args:
        program: the compiled storyboard.
        roads: its road networks, in which all ways are planned that rows may need.
        network: number of the one that rows have.
        more: further bundles by name.

    Raises:
        InputError: it has no such form; the part that has none.
    """
    from bridgegen.simulation.embedded.batch import Batch  # numba is slow to import

    if program.driver.is_own or program.driver.home:
        raise InputError(f"the driver '{program.driver.name}' is no compiled one of BridgeGen's")
    if roads.partners:
        raise InputError("the ego's driver drives several vehicles")
    batch = Batch(program, roads, np.array([network]), {})
    plan = device.coded(batch.plan, program)
    unset: Any = {name: np.zeros_like(getattr(batch.record, name)) for name in UNSET}
    data = bytearray()
    return {
        "plan": _bundle(plan, data),
        "roads": _bundle(roads.tables, data, network),
        "state": _bundle(batch.state, data, 0),
        "record": _bundle(batch.record._replace(**unset), data, 0),
        **{name: _bundle(arrays, data) for name, arrays in more.items()},
        "data": b64encode(zlib.compress(bytes(data), 9)).decode("ascii"),
        "codes": FIELDS,
        "unset": UNSET,
        "friction": FRICTION,
        "driver": program.driver.name,
        "drivers": _others(program, roads, batch, network),
        "functions": FUNCTIONS,
        "parameters": dict(program.parameters),
        "slots": [_as_json(slot) for slot in program.slots],
        "station": {"slots": program.start_slots.tolist(), "pieces": roads.starts(network)},
        "aside": {"slots": program.aside_slots.tolist(), "each": roads.sides[network].tolist()},
        "noise": _noise(program),
    }


def _others(
    program: Program, roads: Network, batch: "Batch", network: int
) -> dict[str, dict[str, Any]]:
    """Return the number of the kernel of each driver that ships, and the shape of its detections.

    A driver is left out where more differs.
    """
    from bridgegen.simulation.embedded.batch import Batch  # numba is slow to import

    found: dict[str, dict[str, Any]] = {}
    here = device.coded(batch.plan, program)
    for name in DEMANDS if program.driver != STORYBOARD else ():
        changed = program.changed(driver=get(name))
        if changed.driver.perceives and not program.driver.perceives:
            continue  # the road tables of others have no hypotheses to predict by
        other = Batch(changed, roads, np.array([network]), {})
        plan = device.coded(other.plan, changed)
        states: Any = zip(batch.state, other.state, strict=True)
        numbers: Any = zip(here._replace(driver_code=0), plan._replace(driver_code=0), strict=True)
        same = all(a.shape == b.shape for a, b in states)
        if same and all(a == b for a, b in numbers if not isinstance(a, np.ndarray)):
            shape = list(other.record.detections.shape[1:])
            found[name] = {"code": plan.driver_code, "detections": shape}
    return found


def _as_json(slot: Value) -> Any:
    if isinstance(slot, Expr):
        return slot.expression.as_json()
    return slot.name if isinstance(slot, ParameterRef) else float(slot)


def _bundle(arrays: NamedTuple, data: bytearray, row: int | None = None) -> list[list[Any]]:
    found: list[list[Any]] = []
    for name, value in zip(arrays._fields, arrays, strict=True):
        if not isinstance(value, np.ndarray):
            found.append([name, value, isinstance(value, float)])
            continue
        array = np.ascontiguousarray(value if row is None else value[row])
        at = -1
        if array.view(np.uint8).any() if array.size else False:
            # A typed array of JavaScript begins at a multiple of its elements' size.
            data += bytes(-len(data) % 8)
            at = len(data)
            data += array.tobytes()
        found.append([name, array.dtype.str[1:], list(array.shape), at])
    return found


def _noise(program: Program) -> dict[str, Any]:
    """Return the key of the row's random numbers, or what it is made of; see `drivers.noise`."""
    if program.noise_key is not None:
        # As text: a number of JSON has 53 bits, a key 64.
        return {"key": str(program.noise_key)}
    words = {
        name: str(int.from_bytes(hashlib.blake2b(name.encode(), digest_size=8).digest(), "little"))
        for name in sorted(program.parameters)
    }
    return {"words": words}
