"""Functions as compiled drivers: what is refused, with which words, and the call itself."""

import ctypes

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.compiled import call_at, kernel
from bridgegen.base.errors import InputError
from bridgegen.drivers.compiled import (
    EGO,
    LANES,
    ROUTE,
    SCENE,
    TRACK,
    CompiledDriver,
    compiled_driver,
)


def helper(x):
    return x


def refused(function, message):
    with pytest.raises(InputError, match=message):
        assert CompiledDriver(function, 0).address


def test_numba_s_reasons_are_told_in_one_line_with_the_place():
    def name(scene, ego, route, tracks, memory):
        return nothing, 1.0  # noqa: F821

    def kinds(scene, ego, route, tracks, memory):
        x = 1.0
        if ego.v > 3.0:
            x = "fast"
        return x, 1.0

    def calls(scene, ego, route, tracks, memory):
        return helper(ego.v), 1.0

    def columns(scene, ego, route, tracks, memory):
        return tracks[:, 2].max(), 1.0

    refused(name, r"^test_compiled.py:\d+: name cannot be compiled: NameError: name 'nothing' is")
    refused(kinds, r"^test_compiled.py:\d+: kinds cannot be compiled: Cannot unify float64 and")
    refused(calls, r"^test_compiled.py:\d+: calls cannot be compiled: Untyped global name 'helper'")
    refused(columns, r"columns cannot be compiled: No implementation of .* getitem\(.*slice")


def test_what_it_takes_and_returns_is_checked():
    refused(lambda scene, ego: (1.0, 1.0), "must take scene, ego, route, tracks, memory")
    refused(lambda a, b, c, d, e: None, r"must return \(acceleration, curvature\), returns none")
    refused(lambda a, b, c, d, e: (1j, 1.0), r"must return \(acceleration, curvature\), returns ")
    for memory in (-1, 1.5):
        with refuses(InputError, "memory"):
            compiled_driver(memory=memory)


def test_the_machine_code_answers_as_the_function_does_in_python():
    def drive(scene, ego, route, tracks, memory):
        memory[0] += 1.0
        return ego.v + route[1].x + tracks[0].vx, scene.max_curvature * len(tracks)

    driver = compiled_driver(memory=1)(drive)
    scene, ego = np.ones(1, SCENE).view(np.recarray), np.full(1, 2.0).astype(EGO).view(np.recarray)
    route, tracks = np.full(3, 3.0).astype(ROUTE), np.full(2, 4.0).astype(TRACK)
    memory, answer = np.zeros(1), np.zeros(3)

    @kernel
    def call(address, a, b, c, d, e, f):
        call_at(address, (a, b, c, d, e, f))

    numbers = [one.view(np.float64) for one in (scene, ego)]
    call(driver.address, *numbers, route.view(np.float64).reshape(3, 4),
         tracks.view(np.float64).reshape(2, 13), memory, answer)  # fmt: skip
    assert answer.tolist() == [9.0, 2.0, 1.0]
    assert memory.tolist() == [1.0]
    told = scene[0], ego[0], route.view(np.recarray), tracks.view(np.recarray), memory
    assert driver(*told) == (9.0, 2.0)


def test_tunable_numbers_are_read_by_the_code_that_is_compiled_once():
    @compiled_driver(wants=("lanes",), tunable={"headway": (1.5, 0.5, 3.0, "s"), "gain": (4, 0, 9)})
    def drive(scene, ego, route, tracks, memory, lanes, settings):
        return settings.headway * ego.v, settings.gain + lanes.ends

    parts = [np.ones(kind.itemsize // 8) for kind in (SCENE, EGO)]
    route, tracks, memory, answer = np.ones((3, 4)), np.ones((2, 13)), np.zeros(0), np.zeros(3)
    lanes = np.full(LANES.itemsize // 8, 2.0)
    rest = [lanes, *(np.zeros(0) for _ in range(5))]

    @kernel
    def call(address, given):
        call_at(address, given)

    for values, expected in (({}, [1.5, 6.0, 1.0]), ({"headway": 2.0}, [2.0, 6.0, 1.0])):
        drive.set(values)
        call(drive.address, (*parts, route, tracks, memory, answer, *rest))
        assert answer.tolist() == expected
    with refuses(InputError, "default=4"):
        compiled_driver(tunable={"gain": (4.0, 0.0, 3.0)})


def test_a_kernel_calls_any_c_function():
    seen = []

    @ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_ssize_t)
    def function(place, n):
        seen.append(np.ctypeslib.as_array((ctypes.c_double * n).from_address(place)).tolist())

    @kernel
    def call(address, a):
        call_at(address, (a,))

    address = ctypes.cast(function, ctypes.c_void_p).value
    call(address, np.array([1.0, 2.0]))
    assert seen == [[1.0, 2.0]]
