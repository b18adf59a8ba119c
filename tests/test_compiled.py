import os
import subprocess
import sys
from pathlib import Path

import pytest

CODE = """
from bridgegen import compiled
print(compiled.cache_folder())
"""


def folder(**environment: str) -> Path:
    done = subprocess.run(
        [sys.executable, "-c", CODE],
        env={"PATH": os.environ["PATH"], **environment},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    return Path(done.stdout.strip())


def test_the_cache_lies_in_the_user_s_cache_folder(tmp_path):
    found = folder(XDG_CACHE_HOME=str(tmp_path))
    assert found.is_relative_to(tmp_path / "bridgegen")
    assert folder(HOME=str(tmp_path)).is_relative_to(tmp_path / ".cache" / "bridgegen")


def test_the_user_may_say_where(tmp_path):
    assert folder(NUMBA_CACHE_DIR=str(tmp_path / "mine")).is_relative_to(tmp_path / "mine")


def test_where_nothing_can_be_written_a_temporary_folder_serves(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    found = folder(HOME=str(blocked), XDG_CACHE_HOME=str(blocked))
    assert found.is_dir()
    assert not found.is_relative_to(blocked)


@pytest.mark.parametrize("values", [[[1.0, float("nan")]], [[1.0, float("inf")]]])
def test_arrays_refuse_what_is_not_finite(values):
    from bridgegen.arrays import as_float

    with pytest.raises(
        ValueError, match=r"speed \[m/s\] must be finite, got (nan|inf) at \[0, 1\]"
    ):
        as_float("speed [m/s]", values, (None, 2))
    assert as_float("speed [m/s]", values, (1, 2), finite=False).shape == (1, 2)


def test_arrays_refuse_another_shape():
    from bridgegen.arrays import as_float

    with pytest.raises(ValueError, match=r"x must have shape \(·, 3\), got \(2, 2\)"):
        as_float("x", [[1, 2], [3, 4]], (None, 3))
