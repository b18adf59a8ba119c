import subprocess
import sys
from importlib.metadata import EntryPoint, EntryPoints

import pytest
from tests.approval import refuses

from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.search.algorithms import ALGORITHMS, Problem, get, names
from bridgegen.search.algorithms.sampling import Random


class Lazy(Random):
    name = "lazy"


class Wrong:
    name = "wrong"


NOT_A_CLASS = Lazy(Problem.unnamed(1), 0)


@pytest.fixture
def installed(monkeypatch):
    """Pretend that a package declares these entry points."""
    sys.modules.setdefault(__name__, sys.modules[__name__])

    def declare(**points: str) -> None:
        found = EntryPoints(
            EntryPoint(name.rstrip("_"), value, "bridgegen.algorithms")
            for name, value in points.items()
        )
        monkeypatch.setattr("importlib.metadata.entry_points", lambda group: found)

    return declare


def test_names_and_classes_agree():
    assert {"random", "pso"} <= set(names())
    for name, algorithm in ALGORITHMS.items():
        assert algorithm.name == name
        assert get(name) is algorithm


def test_unknown_name_suggests_the_nearest():
    with refuses(UnknownNameError, "randon", "random"):
        get("randon")


def test_a_package_adds_its_own(installed):
    installed(lazy=f"{__name__}:Lazy")
    assert names()[-1] == "lazy"
    assert get("lazy") is Lazy
    with refuses(UnknownNameError, "lazy"):
        get("lasy")


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("gone", "no_such_module_here:Thing", "ModuleNotFoundError"),
        ("gone", f"{__name__}:Nothing", "AttributeError"),
        ("wrong", f"{__name__}:Wrong", "description"),
        ("lazy", f"{__name__}:NOT_A_CLASS", "class"),
        ("idle", f"{__name__}:Lazy", "lazy"),
        ("random", f"{__name__}:Lazy", "bridgegen"),
    ],
)
def test_a_package_that_is_wrong_is_named(installed, name, value, message):
    installed(**{name: value})
    with refuses(InputError, message):
        get(name)


def test_two_packages_may_not_share_a_name(installed):
    installed(lazy=f"{__name__}:Lazy", lazy_=f"{__name__}:Random")
    with refuses(InputError):
        get("lazy")


def test_the_import_is_light():
    """Listing the algorithms must not cost the import of those that are not used."""
    code = (
        "import sys, bridgegen.search.algorithms as s; s.get('pso');"
        "print([m for m in ('pymoo', 'pandas', 'scipy', 'numba') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
