"""What the PTX that ships says of itself; and what NVIDIA's assembler says of it, where it is."""

import gzip
import re
import shutil
import subprocess

import pytest

from bridgegen.base import cuda
from bridgegen.simulation.embedded import device, portable

MOST = 4 * 2**20


@pytest.fixture(scope="module")
def text():
    return gzip.decompress(device.PATH.read_bytes()).decode()


def test_the_module_is_of_these_kernels(text):
    """Else run ``tools/portable.py cuda``, which takes five minutes."""
    assert text.splitlines()[0] == f"// bridgegen {portable.device_sources()}"


def test_it_is_small(text):
    assert device.PATH.stat().st_size <= MOST


def test_it_has_one_entry_and_calls_nothing_from_elsewhere(text):
    assert re.findall(r"\.entry (\w+)", text) == ["rows"]
    assert ".extern" not in text
    called = {*re.findall(r"call(?:\.uni)?\s+(?:\(\w+\), )?([\w$.]+)", text)}
    assert called <= {*re.findall(r"^\.func\s+(?:\([^)]*\) )?([\w$.]+)\(", text, re.MULTILINE)}
    assert not re.search(r"call\.?\w*\s+(?:\(\w+\), )?%", text)  # and nothing by its address


def test_each_operation_is_rounded_to_nearest_and_none_is_contracted(text):
    assert "fma." not in text
    floats = re.findall(r"\b((?:add|sub|mul|div|sqrt)\.[\w.]*f64)\b", text)
    assert {*floats} == {f"{name}.rn.f64" for name in ("add", "sub", "mul", "div", "sqrt")}
    assert not re.search(r"\b\w+\.(approx|ftz|full)\b|\.f32\b", text)


def test_what_calls_in_circles_is_known(text):
    """Else see whether ``cuda.STACK`` suffices."""
    calls, name = {}, ""
    for line in text.splitlines():
        if found := re.match(r"(?:\.visible )?\.(?:func|entry)\s+(?:\([^)]*\) )?([\w$.]+)\(", line):
            name = found[1]
        elif found := re.match(r"\s+call\.uni (?:\(\w+\), )?([\w$.]+)", line):
            calls.setdefault(name, set()).add(found[1])

    def reached(start):
        found, left = set(), [*calls.get(start, ())]
        while left:
            if (one := left.pop()) not in found:
                found.add(one)
                left += calls.get(one, ())
        return found

    circles = {one for one in calls if one in reached(one)}
    # The merge sort does; kernels of places do not, but share a switch with what calls them.
    known = ("argmergesort", "_place_kernels", "call_")
    assert all(any(name in one for name in known) for one in circles)


def test_it_names_no_file_of_the_machine_that_made_it(text):
    assert ".py" not in text


@pytest.mark.thorough
def test_the_assembler_takes_it(text, tmp_path):
    """By its fastest level, since the others take five minutes and more."""
    if (ptxas := shutil.which("ptxas")) is None or "-Ofc" not in help_of(ptxas):
        pytest.skip("needs ptxas 12.9 or later")
    (tmp_path / "kernels.ptx").write_text(text)
    command = [ptxas, "-v", "-O0", "-Ofc", "max", "-arch=sm_90", "-o", "out", "kernels.ptx"]
    said = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path).stderr
    (stack,) = re.findall(r"(\d+) bytes cumulative stack size", said)
    assert int(stack) <= cuda.STACK


def help_of(program):
    return subprocess.run([program, "--help"], capture_output=True, text=True, check=True).stdout
