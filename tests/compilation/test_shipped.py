"""Compiled code that an installation carries: used where it fits, else compiled as always."""

import importlib.util
import json
import shutil
from pathlib import Path

import pytest
import yaml

from bridgegen.base.compilation import folder as shipped_module
from bridgegen.base.compilation.folder import BASELINE, described, features, shipped

ROOT = Path(__file__).parents[2]
CODE = (
    "from bridgegen._high_kernels import high\n    import math; assert high(0.0) == 2 * math.sin(1)"
)


@pytest.fixture
def carried(package, compile_once):
    """The package with its kernels' code inside, and no cache."""
    machine = {"NUMBA_CPU_NAME": BASELINE, "NUMBA_CPU_FEATURES": features()}
    (compiled,) = (compile_once(CODE, **machine) / "bridgegen").iterdir()
    shutil.copytree(compiled, package / "_kernels")
    (package / "_kernels" / "machine.json").write_text(json.dumps(described()))
    return package


def fits() -> bool:
    """Whether this machine is one for which wheels are made."""
    return described()["triple"] == "x86_64-unknown-linux-gnu"


@pytest.mark.skipif(not fits(), reason="not a machine for which wheels carry code")
def test_carried_code_is_used_and_not_written(carried, compiled_by):
    before = sorted(path for path in carried.rglob("*") if path.is_file())
    assert compiled_by(CODE) == []
    assert before == sorted(path for path in carried.rglob("*") if path.is_file())
    (carried / "_constants.py").write_text("FACTOR = 2.0  # another digest\n")
    assert compiled_by(CODE) == ["high", "low"]


def test_code_for_something_else_is_not_used(carried, compiled_by):
    (carried / "_kernels" / "machine.json").write_text(json.dumps(described() | {"numba": "0.1"}))
    assert compiled_by(CODE) == ["high", "low"]


@pytest.fixture
def found(tmp_path, monkeypatch):
    """Returns what is found of an installation whose code is described by a text."""
    monkeypatch.setattr(shipped_module, "FOLDER", tmp_path)

    def found_with(text):
        (tmp_path / "machine.json").write_text(text)
        return shipped.__wrapped__()

    if fits():
        assert found_with(json.dumps(described())).folder == tmp_path
    return found_with


@pytest.mark.parametrize("key", ["python", "numba", "triple"])
def test_a_description_of_something_else_does_not_fit(found, key):
    assert found(json.dumps(described() | {key: "other"})) is None


def test_code_for_a_better_processor_does_not_fit(found, monkeypatch):
    monkeypatch.setattr(shipped_module, "FEATURES", (*shipped_module.FEATURES, "avx1024"))
    assert found(json.dumps(described())) is None


@pytest.mark.parametrize("text", ["", "{", "[]", "\0"])
def test_a_damaged_description_is_no_description(found, text):
    assert found(text) is None


def test_a_clone_carries_nothing():
    assert shipped() is None


def test_the_tag_of_a_wheel(tmp_path):
    spec = importlib.util.spec_from_file_location("build_wheel", ROOT / "tools" / "build_wheel.py")
    build_wheel = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(build_wheel)
    about = tmp_path / "bridgegen-1.dist-info" / "WHEEL"
    about.parent.mkdir()
    about.write_text("Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n\n")
    build_wheel.tag(tmp_path)
    lines = about.read_text().splitlines()
    assert lines[:2] == ["Wheel-Version: 1.0", "Root-Is-Purelib: false"]
    assert lines[2].startswith("Tag: cp3")
    assert lines[2].endswith("-none-manylinux_2_28_x86_64")


def test_the_job_and_the_image_build_wheels():
    job = yaml.safe_load((ROOT / ".github" / "workflows" / "wheels.yml").read_text("utf-8"))
    steps = [step.get("run", "") for step in job["jobs"]["wheel"]["steps"]]
    build = "python tools/build_wheel.py"
    assert any(step.startswith(build) for step in steps)
    assert build in (ROOT / "Dockerfile").read_text("utf-8")
