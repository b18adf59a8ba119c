"""The code of kernels that are called, not linked: one process compiles it, others use it."""

import shutil

import pytest

pytestmark = pytest.mark.thorough

HIGH = "from bridgegen._high_kernels import high\n    "
LOW = "from bridgegen._low_kernels import low\n    "
CHECK = "import math; assert high(0.5) == 2.0 * math.sin(0.5) + 2.0 * math.sin(1.5)"
FOR_KERNELS = "from bridgegen.base.compiled import compile_for_kernels; import numba\n    "


@pytest.fixture
def compiled(package, compile_once):
    """The package, once a process has compiled both kernels."""
    shutil.copytree(compile_once(HIGH + CHECK), package.parent / "cache")
    return package


def code(package, kind):
    return sorted((package.parent / "cache").rglob(f"code/*.{kind}"))


def test_a_kernel_that_another_process_compiled_is_called(package, compiled_by):
    assert compiled_by(LOW + FOR_KERNELS + "compile_for_kernels(low, (numba.float64,))") == ["low"]
    assert len(code(package, "bc")) == 1
    assert not code(package, "o")  # nobody has called it yet
    assert compiled_by(HIGH + CHECK) == ["high"]
    assert len(code(package, "o")) == 1
    assert compiled_by(HIGH + CHECK) == []


def test_python_may_call_what_kernels_call(compiled, compiled_by):
    both = HIGH + LOW + CHECK + "; assert low(0.5) == 2.0 * math.sin(0.5)"
    assert compiled_by(both) == ["low"]  # for Python
    assert compiled_by(both) == []
    assert compiled_by(both.replace("high(0.5)", "high(0.5 + 0.0 * low(1.0))")) == []


@pytest.mark.parametrize("damage", [b"", b"\0" * 512, None])
@pytest.mark.parametrize("kind", ["bc", "o"])
def test_damaged_code_is_made_anew(compiled, compiled_by, kind, damage):
    (file,) = code(compiled, kind)
    file.write_bytes(file.read_bytes()[:-9] if damage is None else damage)
    assert compiled_by(HIGH + CHECK) in ([], ["high", "low"])
    assert compiled_by(HIGH + CHECK) == []


def test_lost_code_is_made_anew(compiled, compiled_by):
    (folder,) = (compiled.parent / "cache").rglob("code")
    shutil.rmtree(folder)
    assert compiled_by(HIGH + CHECK) == ["high", "low"]
    assert compiled_by(HIGH + CHECK) == []
