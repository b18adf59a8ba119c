"""openpilot's longitudinal planner out of a checkout of it, without the rest of openpilot.

The planner's own files are imported as they are. What they import of openpilot's hardware, messages
and log is represented by modules that hold names only; the two limits of acceleration that opendbc
gives them stand here. The solver is generated and built once, in the user's cache, by
``comma-deps-acados``; nothing is written to the checkout.
"""

import ctypes
import hashlib
import importlib
import importlib.util
import io
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.metadata import version
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from bridgegen.base.errors import InputError

VARIABLE = "OPENPILOT"
"""The environment variable that names the checkout."""

VERSION = "0.11"
"""The series of openpilot that is supported; tested: 0.11.2 of 20 June 2026."""

TESTED = "ad5151b38b540e08a01c87029c3ddb0979ba4fdf"
"""Commit of the tested version, as a fork has it: see its date, where this one is not found."""

HOW_TO_GET = (
    "GIT_LFS_SKIP_SMUDGE=1 git clone https://github.com/commaai/openpilot, check out a commit of "
    f"version {VERSION} (tested: {TESTED[:10]}), and set {VARIABLE} to that folder; gcc, make and "
    "Python's headers build its solver once"
)

STEP = 0.05
"""Time between two plans [s]; openpilot's ``DT_MDL``."""

_LIB = "openpilot.selfdrive.controls.lib"
_MPC = f"{_LIB}.longitudinal_mpc_lib.long_mpc"
_NAMES_ONLY = (
    "capnp",
    "cereal",
    "opendbc",
    "setproctitle",
    "zmq",
    "zstandard",
    "openpilot.common.hardware",
    "openpilot.common.params",
    "openpilot.common.swaglog",
    f"{_LIB}.longitudinal_mpc_lib.c_generated_code",
)
_LIMITS = {"ACCEL_MIN": -3.5, "ACCEL_MAX": 2.0}
"""Limits of the acceleration [m/s²], from opendbc's car/interfaces.py, after ISO 15622:2018."""

_LIBRARIES = ("libblasfeo.so", "libhpipm.so", "libqpOASES_e.so.3.1", "libacados.so")


class Openpilot(NamedTuple):
    """What the adapter uses of openpilot.

    Attributes:
        LongitudinalPlanner: its class of this name.
        radard: its module of this name.
        running: what ``controlsState.longControlState`` is while it drives.
        standard: the personality "standard", its default.
    """

    LongitudinalPlanner: Any
    radard: Any
    running: Any
    standard: Any


def load() -> Openpilot:
    """Import the planner from the checkout, and build its solver if that has not been done.

    Raises:
        InputError: there is no checkout, it is of another version, a package is missing, or the
            solver cannot be built.
    """
    folder = checkout()
    with imported_from(folder):
        try:
            mpc: Any = importlib.import_module(_MPC)
            planner: Any = importlib.import_module(f"{_LIB}.longitudinal_planner")
            control: Any = importlib.import_module(f"{_LIB}.longcontrol")
            radard: Any = importlib.import_module("openpilot.selfdrive.controls.radard")
        except (ImportError, AttributeError) as error:
            raise InputError(
                f"openpilot cannot be imported from {folder} ({error}); it must be a checkout of "
                f"openpilot {VERSION}: {HOW_TO_GET}"
            ) from error
        mpc.AcadosOcpSolverCython = solver(mpc)
    return Openpilot(
        planner.LongitudinalPlanner,
        radard,
        control.LongCtrlState.pid,
        mpc.log.LongitudinalPersonality.standard,
    )


def checkout() -> Path:
    """Return the user's checkout.

    Raises:
        InputError: none is named, or it is none of the supported version.
    """
    named = os.environ.get(VARIABLE)
    if not named:
        raise InputError(f"the planner 'openpilot-longitudinal' needs openpilot: {HOW_TO_GET}")
    folder = Path(named).resolve()
    header = folder / "common" / "version.h"
    try:
        with header.open(encoding="utf-8") as file:
            found = file.read(1000).partition('COMMA_VERSION "')[2].partition('"')[0]
    except (OSError, UnicodeDecodeError):
        found = ""
    if not found.startswith(f"{VERSION}."):
        raise InputError(
            f"{VARIABLE} must name a checkout of openpilot {VERSION}, got {folder}, which "
            + (f"is version {found}" if found else "has no common/version.h that says so")
            + f": {HOW_TO_GET}"
        )
    return folder


# --- Importing ------------------------------------------------------------------------------------


@contextmanager
def imported_from(checkout: Path) -> Iterator[None]:
    """Let openpilot's modules be imported from a checkout; afterwards they are forgotten again."""
    before, finder = set(sys.modules), _NamesOnly()
    sys.meta_path.insert(0, finder)
    sys.path.insert(0, str(checkout))
    # Nothing is written to the user's checkout, compiled files either.
    writes, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    try:
        yield
    finally:
        sys.dont_write_bytecode = writes
        sys.path.remove(str(checkout))
        sys.meta_path.remove(finder)
        for name in set(sys.modules) - before:
            # Forgotten afterwards: other code of the process may import the real modules of these
            # names.
            if name.partition(".")[0] == "openpilot" or _is_names_only(name):
                del sys.modules[name]


def _is_names_only(name: str) -> bool:
    return any(name == item or name.startswith(f"{item}.") for item in _NAMES_ONLY)


class _Name:
    """A name that openpilot looks up in a module that is not there; equal to itself alone."""

    def __getattr__(self, name: str) -> "_Name":
        if name.startswith("__"):
            raise AttributeError(name)
        found = _Name()
        setattr(self, name, found)
        return found

    def __call__(self, *_: Any, **__: Any) -> None:
        """Do nothing, as for a message to the log."""


class _Names(ModuleType):
    """A module that holds names only."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        found = _LIMITS.get(name, _Name())
        setattr(self, name, found)
        return found


class _NamesOnly(MetaPathFinder, Loader):
    """Finds the modules that are represented by names."""

    def find_spec(self, name: str, *_: Any) -> ModuleSpec | None:
        return ModuleSpec(name, self, is_package=True) if _is_names_only(name) else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        return _Names(spec.name)

    def exec_module(self, module: ModuleType) -> None:
        pass


# --- The solver -----------------------------------------------------------------------------------


def solver(mpc: Any) -> Any:
    """Return acados' class for the planner's optimal control problem, built if need be.

    Raises:
        InputError: acados is not installed, or the problem cannot be built.
    """
    import fcntl  # acados' package is for Linux alone

    from bridgegen.base.compilation.folder import cache_folder  # only this user can have written it

    try:
        import acados
        import acados.acados_template
    except ImportError as error:
        raise InputError(
            f"openpilot-longitudinal needs acados ({error}): pip install comma-deps-acados cython"
        ) from error
    source = Path(mpc.__file__).read_bytes()
    # What the compiled solver depends on; another version of any of it gets a folder of its own.
    of = (sys.version, version("comma-deps-acados"), version("numpy"), str(acados.DIR))
    digest = hashlib.sha256(source + repr(of).encode()).hexdigest()[:16]
    folder = cache_folder() / f"openpilot-{digest}"
    folder.mkdir(exist_ok=True)
    code, tree = folder / "code", folder / "acados"
    built = code / "acados_ocp_solver_pyx.so"
    done = folder / "done"
    with (folder / "lock").open("wb") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # another process may build it now
        if not done.exists():
            _link(acados, tree)
            said = _build(mpc, acados.acados_template, tree, code)
            if not built.is_file():
                raise InputError(
                    "openpilot's solver could not be built, which needs gcc, make, Python's "
                    f"headers and cython (pip install cython): {said}"
                )
            done.touch()
    for library in _LIBRARIES:
        ctypes.CDLL(str(tree / "lib" / library), ctypes.RTLD_GLOBAL)
    spec = importlib.util.spec_from_file_location("acados_ocp_solver_pyx", built)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.AcadosOcpSolverCython


def _link(acados: Any, tree: Path) -> None:
    """Arrange the package's folders as acados' templates expect its sources."""
    template = tree / "interfaces" / "acados_template" / "acados_template"
    links = {template: acados.TEMPLATE_DIR, tree / "lib": acados.LIB_DIR}
    include = Path(acados.INCLUDE_DIR)  # "include/.." must be the tree, so its parts are links
    links |= {tree / "include" / path.name: str(path) for path in include.iterdir()}
    for link, target in links.items():
        link.parent.mkdir(parents=True, exist_ok=True)
        link.unlink(missing_ok=True)
        link.symlink_to(target)


def _build(mpc: Any, template: Any, tree: Path, code: Path) -> str:
    """Generate the solver's code and compile it; return the last lines that make prints."""
    import acados

    mpc.AcadosModel, mpc.AcadosOcp = template.AcadosModel, template.AcadosOcp
    mpc.EXPORT_DIR = str(code)
    said = {"ACADOS_SOURCE_DIR": str(tree), "TERA_PATH": acados.TERA_PATH}
    before = {name: os.environ.get(name) for name in said}
    os.environ.update(said)
    try:
        with redirect_stdout(io.StringIO()):
            problem = mpc.gen_long_ocp()
            template.AcadosOcpSolver.generate(problem, json_file=str(code.parent / "problem.json"))
    finally:
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})
    return _compile(code)


def _compile(code: Path) -> str:
    """Compile the generated code; return the last lines that make prints."""
    # Where cython is, if the environment is not activated
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', os.defpath)}"
    try:
        made = subprocess.run(
            ["make", "ocp_cython"],
            cwd=code,
            env=os.environ | {"PATH": path},
            text=True,
            errors="replace",
            check=False,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
    except OSError as error:
        return f"make cannot be run: {error.strerror}"
    return " / ".join(made.stdout.strip().splitlines()[-3:])[-500:]
