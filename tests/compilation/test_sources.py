"""What a change of a source file has compiled again: what depends on it, and nothing else."""

from bridgegen.base.compilation.folder import PACKAGE, digest

ALL = """from bridgegen._high_kernels import high
    from bridgegen._other_kernels import other
    high(1.0), other(1.0)"""


def test_a_constant_from_elsewhere_counts_and_other_kernels_do_not(package, compiled_by):
    """Numba bakes it into the code: with another value, the code is another."""
    assert compiled_by(ALL) == ["high", "low", "other"]
    assert compiled_by(ALL) == []
    (package / "_constants.py").write_text("FACTOR = 3.0\n")
    check = ALL + "\n    import math; assert high(0.0) == 3.0 * math.sin(1.0)"
    assert compiled_by(check) == ["high", "low"]
    (package / "_other_kernels.py").write_text((package / "_other_kernels.py").read_text() + "\n")
    assert compiled_by(ALL) == ["other"]
    app = package / "cli" / "app.py"
    app.write_text(app.read_text() + "\n")
    assert compiled_by(ALL) == []


def test_what_was_compiled_for_an_earlier_source_serves_again(package, compiled_by):
    assert compiled_by(ALL) == ["high", "low", "other"]
    (package / "_constants.py").write_text("FACTOR = 3.0\n")
    assert compiled_by(ALL) == ["high", "low"]
    (package / "_constants.py").write_text("FACTOR = 2.0\n")
    assert compiled_by(ALL + "\n    import math; assert high(0.0) == 2.0 * math.sin(1.0)") == []


def test_names_of_a_package_may_be_modules():
    """`from package import module` counts that module."""
    rollout = PACKAGE / "simulation" / "embedded" / "batch.py"
    from bridgegen.base.compilation.folder import _imported

    assert PACKAGE / "simulation" / "embedded" / "_memory_kernels.py" in _imported(rollout)
    assert digest(rollout) == digest(rollout)
