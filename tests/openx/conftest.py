"""The fixture ``checkers`` and its marker, for everything that writes OpenDRIVE or OpenSCENARIO."""

import importlib.util
import os
import sys
from pathlib import Path
from typing import Any

import pytest

VARIABLE = "BRIDGEGEN_CHECKERS"


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line(
        "markers",
        f"checkers: needs the ASAM quality checkers and SUMO in the venv that {VARIABLE} names",
    )


@pytest.fixture(scope="session")
def checkers() -> Any:
    venv = os.environ.get(VARIABLE)
    if not venv:
        pytest.skip(f"{VARIABLE} is not set")
    assert (Path(venv) / "bin/python").exists(), f"{VARIABLE}={venv} is not a virtual environment"
    # Test modules are imported by path (importmode=importlib), so this one must be, too.
    path = Path(__file__).with_name("checkers.py")
    spec = importlib.util.spec_from_file_location("openx_checkers", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module.Checkers(Path(venv))
