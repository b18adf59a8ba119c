"""Settings for the whole suite, the strangers that judge our files, and a browser for pages."""

import importlib.util
import os
import shutil
import signal
import sys
import time
from collections import Counter
from collections.abc import Iterator
from importlib.metadata import EntryPoint, EntryPoints
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings
from tests.approval import Approval

from bridgegen.assess.metrics import registry
from bridgegen.base.processes.child import ONE_THREAD, collect_rarely

CHECKERS = "BRIDGEGEN_CHECKERS"

LONGEST = (
    "test_snippets.py", "sensitivity/test_sensitivity.py", "campaign/test_catalogue.py",
    "campaign/test_campaign.py", "search/test_contract.py", "test_fuzzing.py",
    "campaign/test_export.py", "triage/test_run.py", "benchmark/test_benchmark.py",
    "risk/test_risk.py", "risk/estimators/test_contract.py", "reproduction/test_reproduction.py",
    "campaign/test_ahead.py", "simulation/test_contract.py", "suite/test_page.py",
    "mining/events/test_round_trip.py", "mining/events/test_merging_round_trip.py",
    "campaign/test_file_scenario.py", "compilation/test_library.py",
)  # fmt: skip
"""Files that take some ten seconds of processor time or more: processes take them first."""

EXAMPLES = 45
"""Examples that a property test draws, unless it states another number."""

# No deadline: the first example may compile a kernel, and shared machines stall. The same examples
# each time: whether a test passes is no matter of luck. BRIDGEGEN_EXPLORE=N draws N new ones.
settings.register_profile("same", deadline=None, max_examples=EXAMPLES, derandomize=True)
if explored := os.environ.get("BRIDGEGEN_EXPLORE"):
    settings.register_profile("explore", deadline=None, max_examples=int(explored))
settings.load_profile("explore" if explored else "same")

# Rewriting the assertions of all test modules takes each process 40 s, unless it may be kept.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# A process for each core: threads of linear algebra would only wait for each other. Before NumPy.
os.environ.update(ONE_THREAD)

# A search for cyclic garbage visits the 600,000 objects of all test modules: it is made less often.
collect_rarely()

# A shell's background job ignores Ctrl-C, and what it starts inherits that: some tests send it.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--approve-messages",
        action="store_true",
        help="write the messages of the tests that pass into tests/messages.txt",
    )


def pytest_configure(config: pytest.Config) -> None:
    config.pluginmanager.register(Approval())


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Order files that processes share: the longest, then by number of tests.

    So that no process has a long file to run when the others have none.
    """
    if "PYTEST_XDIST_WORKER" in os.environ:
        sort_by_file(items)
    if explored:
        explore(items, int(explored) / EXAMPLES)


def explore(items: list[pytest.Item], factor: float) -> None:
    """Let tests that state how many examples they draw, the slow ones, draw ``factor`` as many."""
    drawn = "_hypothesis_internal_use_settings"
    for test in {getattr(item, "function", None) for item in items}:
        own = getattr(test, drawn, None)
        if own is not None and own.max_examples != int(os.environ["BRIDGEGEN_EXPLORE"]):
            setattr(test, drawn, settings(own, max_examples=int(factor * own.max_examples) or 1))


def sort_by_file(items: list[Any]) -> None:
    """Sort items by their ``path``, in place; those of a file stay together, in their order."""
    longest = {Path(__file__).parent / name: len(LONGEST) - k for k, name in enumerate(LONGEST)}
    number = Counter(item.path for item in items)
    items.sort(key=lambda item: (longest.get(item.path, 0), number[item.path]), reverse=True)


@pytest.fixture(autouse=True)
def forgotten_metrics() -> Iterator[None]:
    """Forget the metrics that a test reads from a file: other tests list those that are known."""
    yield
    for name in [*registry._NAMED]:
        registry._NAMED.remove(name)
        del registry.METRICS[name]


@pytest.fixture(scope="session")
def same_rows() -> Any:
    """Say whether two runs, by their folders, have recorded the same, to the bit."""
    from bridgegen.results.store import Store

    names = ("id", "U", "X", "metrics", "F", "status", "critical", "cause")

    def same(one: Path, other: Path) -> bool:
        with Store.open(one) as a, Store.open(other) as b:
            rows, others = a.read(), b.read()
        return all(getattr(rows, n).tobytes() == getattr(others, n).tobytes() for n in names)

    return same


@pytest.fixture
def cli(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Any:
    """Run a command line; return (exit status, standard output, standard error)."""

    from bridgegen.cli import main

    def run(*words: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["bridgegen", *map(str, words)])
        with pytest.raises(SystemExit) as end:
            main()
        out, err = capsys.readouterr()
        return int(end.value.code or 0), out, err

    return run


@pytest.fixture(scope="session")
def checkers() -> Any:
    """The ASAM quality checkers and SUMO, in the venv that the environment variable names."""
    venv = os.environ.get(CHECKERS)
    if not venv:
        pytest.skip(f"{CHECKERS} is not set")
    assert (Path(venv) / "bin/python").exists(), f"{CHECKERS}={venv} is not a virtual environment"
    # Test modules are imported by path (importmode=importlib), so this one must be, too.
    path = Path(__file__).with_name("checkers.py")
    spec = importlib.util.spec_from_file_location("checkers", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module.Checkers(Path(venv))


OPTIONS = ["--no-sandbox", "--disable-background-networking", "--disable-component-update"]


def wait_for(page: Any, condition: str, *, seconds: float = 30.0) -> None:
    """Wait until an expression is true on a page.

    Playwright's own ``wait_for_function`` evaluates text inside of the page, which the pages'
    Content-Security-Policy forbids; ``evaluate`` asks from outside.
    """
    end = time.monotonic() + seconds
    while not page.evaluate(condition):
        if time.monotonic() > end:
            pytest.fail(f"never true within {seconds:g} s: {condition}")
        page.wait_for_timeout(20)


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    chromium = shutil.which("chromium")
    if chromium is None:
        pytest.skip("chromium is not installed")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=OPTIONS)
        with pytest.MonkeyPatch.context() as patched:
            for kind in (sync_api.Page, sync_api.Frame):
                patched.setattr(kind, "wait_for_function", wait_for)
            yield browser
        browser.close()


@pytest.fixture
def declare_entry_points(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Pretend that an installed package declares entry points in a test's module."""

    def declare(registry: Any, group: str, module: str, **points: str) -> None:
        found = EntryPoints(
            EntryPoint(name, f"{module}:{value}", group) for name, value in points.items()
        )

        def entry_points(**which: str) -> EntryPoints:
            return found.select(**which)

        monkeypatch.setattr(registry, "_loaded", {})
        monkeypatch.setattr("importlib.metadata.entry_points", entry_points)

    return declare


@pytest.fixture(scope="module")
def add_planners(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """Return what installs a package with planners, here and in processes that begin.

    They are those of ``ego/planner_packages.py``: the name of each, and that of its constant.
    """
    from bridgegen.drivers import planners as registry

    site, code = tmp_path_factory.mktemp("site"), Path(__file__).with_name("ego")
    info = site / "planner_packages-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: planner-packages\nVersion: 1\n")
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("PYTHONPATH", f"{site}:{code}")
        for folder in (site, code):
            patched.syspath_prepend(str(folder))

        def install(**points: str) -> None:
            lines = [f"{name} = planner_packages:{value}" for name, value in points.items()]
            (info / "entry_points.txt").write_text("\n".join(["[bridgegen.drivers]", *lines]))
            os.utime(site)  # as if installed now
            patched.setattr(registry.planners(), "_loaded", {})

        yield install
