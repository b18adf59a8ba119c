"""A small helping of ``fuzzing.py``; by hand it takes more inputs, and strangers' files."""

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.thorough


def test_mutated_files_are_read_or_refused():
    command = [sys.executable, str(Path(__file__).with_name("fuzzing.py"))]
    done = subprocess.run(
        [*command, "--inputs", "240", "--jobs", "2"], capture_output=True, text=True, timeout=600
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "read" in done.stdout
    assert "refused" in done.stdout
