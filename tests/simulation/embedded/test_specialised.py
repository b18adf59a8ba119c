"""Code specialised to a storyboard: the same bits, and never in the way."""

import time

import numpy as np
import pytest
from numba.core.registry import cpu_target

from bridgegen.base.compilation.library import KernelLibrary, MissingCodeError
from bridgegen.base.compilation.whole_program import machine_code, with_constants
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.embedded import _rollout_kernels as kernels
from bridgegen.simulation.embedded import specialised


@pytest.fixture(autouse=True)
def nothing_known(monkeypatch):
    monkeypatch.setattr(specialised, "_KNOWN", type(specialised._KNOWN)())
    monkeypatch.setattr(specialised, "_COMPILING", [])


def batches(name, ego, n=40, **how):
    """Yield functions that set up random rows of a scenario, one for each storyboard."""
    logical = load(name)
    space = logical.space()
    runner = Pipeline(logical, space, PipelineOptions(ego=ego)).runner
    X = space.decode(np.random.default_rng(5).random((n, space.n_var)))
    for at, one in runner.by_variant(X):
        roads, rows = one.roads_of(X[at])
        values = one.columns(X[at])
        yield lambda one=one, roads=roads, rows=rows, values=values: one.embedded.batch(
            roads, rows, values, **how
        )


def bits(batch):
    return {
        f"{name}.{field}": np.ascontiguousarray(array).tobytes()
        for name, arrays in (("state", batch.state), ("record", batch.record))
        for field, array in arrays._asdict().items()
    }


def generic(make):
    batch = make()
    batch.run(kernels.simulate_rows)
    return bits(batch)


@pytest.fixture
def nothing_stored(monkeypatch):
    """Programs of storyboards are kept here, not in the cache."""
    store, written = type(KernelLibrary.store), {}
    read, keep = store.read, store.write

    def is_program(symbol):
        return symbol.startswith("specialised")

    def found(here, symbol, kind):
        return written.get((symbol, kind)) if is_program(symbol) else read(here, symbol, kind)

    def write(here, symbol, kind, content):
        if is_program(symbol):
            written[symbol, kind] = content
        else:
            keep(here, symbol, kind, content)

    monkeypatch.setattr(store, "read", found)
    monkeypatch.setattr(store, "write", write)
    monkeypatch.setattr(specialised, "WORTHWHILE", 0.0)
    return written


def in_specialised_code(make, monkeypatch):
    """Run with code specialised to the storyboard, compiled here."""
    monkeypatch.setattr(specialised, "COST", np.inf)
    for _ in range(3):  # the second one asks whether there is code
        make().run()
    codegen = cpu_target.target_context.codegen()
    for storyboard in specialised._KNOWN.values():
        if storyboard.job and not storyboard.address:
            storyboard.code = machine_code(codegen, *storyboard.job)
    batch = make()
    batch.run()
    assert list(specialised._KNOWN.values())[-1].address
    return bits(batch)


def differing(mine, wanted):
    return [name for name in wanted if mine[name] != wanted[name]]


@pytest.mark.thorough
def test_storyboards_have_the_same_bits_beside_each_other(monkeypatch, nothing_stored):
    for name in ("crossroads-s4", "crossroads-s1"):
        (make,) = batches(name, "route-follower")
        assert not differing(in_specialised_code(make, monkeypatch), generic(make))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("name", "ego", "how"),
    [
        ("crossroads-s4", "reference", {}),
        ("phantom-braking", "reference", {}),  # sensors see what is not there
        ("lead-brakes", "careful", {"until_collision": True}),
        ("merge-ego", "route-follower", {}),  # ways are planned while rows run
        ("motorway-merge", "reference", {}),
        ("oncoming-left-at-signals", "fsm", {}),
        ("rain-sets-in", "reference", {}),
    ],
)
def test_the_same_bits_whatever_runs(monkeypatch, nothing_stored, name, ego, how):
    make = next(iter(batches(name, ego, **how)))
    assert not differing(in_specialised_code(make, monkeypatch), generic(make))


@pytest.mark.thorough
def test_another_process_compiles_it_while_rows_run(monkeypatch, nothing_stored):
    (make,) = batches("crossroads-s4", "route-follower", 8)
    wanted = generic(make)
    monkeypatch.setattr(specialised, "COST", 0.0)
    until = time.monotonic() + 300.0
    while not (specialised._KNOWN and next(iter(specialised._KNOWN.values())).address):
        assert time.monotonic() < until
        batch = make()
        batch.run()
        assert not differing(bits(batch), wanted)
        time.sleep(0.05)
    assert nothing_stored["specialised", "seconds"] > 0.0
    # The next process finds it.
    specialised._KNOWN.clear()
    monkeypatch.setattr(specialised, "Child", None)
    for _ in range(4):
        make().run()
    (storyboard,) = specialised._KNOWN.values()
    assert storyboard.address


def test_few_rows_have_nothing_compiled(monkeypatch):
    monkeypatch.setattr(specialised, "Child", None)
    (make,) = batches("crossroads-s4", "route-follower", 8)
    for _ in range(3):
        make().run()
    (storyboard,) = specialised._KNOWN.values()
    assert storyboard.job is None


@pytest.mark.parametrize("program", [["-c", "raise SystemExit(3)"], ["-m", "no.such.module"]])
def test_without_code_rows_run_on(monkeypatch, nothing_stored, program):
    (make,) = batches("crossroads-s4", "route-follower", 8)
    wanted = generic(make)
    started = []

    def child(_, take, errors):
        started.append(process := start(program, take, errors=errors))
        return process

    start = specialised.Child
    monkeypatch.setattr(specialised, "Child", child)
    monkeypatch.setattr(specialised, "COST", 0.0)
    for _ in range(6):
        batch = make()
        batch.run()
        assert not differing(bits(batch), wanted)
    assert len(started) == 1  # it is not tried again
    started[0].end()
    make().run()
    assert not specialised._COMPILING


def test_a_kernel_whose_code_is_lost_is_said_to_be(nothing_stored):
    (make,) = batches("crossroads-s4", "route-follower", 1)
    make().run()
    with pytest.raises(MissingCodeError, match="elsewhere"):
        machine_code(cpu_target.target_context.codegen(), "elsewhere", [], {}, [], "name")


IR = """\
define i32 @_ZN4look7PLACEx{kind}(ptr %retptr, ptr %excinfo, i64 %arg.k, ptr %arg.plan) {{
  %.1 = getelementptr inbounds nuw i8, ptr %arg.plan, i64 16
  %.2 = load i64, ptr %.1, align 8
  %.3 = load double, ptr %arg.plan, align 8
  %.4 = getelementptr inbounds nuw i8, ptr %arg.plan, i64 24
  %.5 = load i64, ptr %.4, align 8
  %.6 = load i64, ptr %excinfo, align 8
"""


def test_only_what_is_known_of_a_bundle_is_a_constant():
    kind = "31Bundle_28Plan_2d6509fb201425_29"
    lines = IR.format(kind=kind).splitlines()
    known = {kind: {0: "double 0x3FF0000000000000", 16: "i64 3", 24: "double 0x0"}}
    found = list(with_constants(lines, known))
    changed = {line for line in found if line not in lines}
    assert changed == {
        "  %.2 = add i64 3, 0",
        "  %.3 = select i1 true, double 0x3FF0000000000000, double 0x3FF0000000000000",
    }
    assert list(with_constants(lines, {kind.replace("31", "32"): known[kind]})) == lines
    two = [lines[0].replace(kind, 2 * kind), *lines[1:]]  # which of them, is not known
    assert list(with_constants(two, known)) == two
