"""The cache of compiled kernels: where it lies, whose it is, what damage and haste do to it."""

import os
import shutil
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

import bridgegen
from bridgegen.base.compilation.folder import cache_folder

FOLDER = """
from bridgegen.base.compilation import folder
print(folder.cache_folder())
"""
COMPILES = """
import sys
sys.path.insert(0, sys.argv[1])
from numba.core import event
with event.install_recorder("numba:compile") as recorder:
    import mine
    assert mine.doubled(21.0) == 42.0
print(sum(one.is_start for _, one in recorder.buffer))
"""
MINE = """
from bridgegen.base.compiled import kernel

@kernel
def doubled(x):
    return 2.0 * x
"""


def begin(code: str, *words: object, **environment: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-W", "error", "-c", code, *map(str, words)],
        env={"PATH": os.environ["PATH"], **environment},
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def result(process: subprocess.Popen[str]) -> str:
    out, err = process.communicate(timeout=120.0)
    assert not err
    assert process.returncode == 0
    return out.strip()


@pytest.fixture
def folder(monkeypatch):
    """Returns the cache's folder in an environment that has but some variables."""

    def found(**environment: str) -> Path:
        with monkeypatch.context() as patched:
            for name in ("HOME", "NUMBA_CACHE_DIR", "TMPDIR", "XDG_CACHE_HOME"):
                patched.delenv(name, raising=False)
            for name, value in environment.items():
                patched.setenv(name, value)
            patched.setattr(tempfile, "tempdir", None)
            return cache_folder.__wrapped__()

    return found


def test_the_cache_lies_in_the_user_s_cache_folder(folder, tmp_path):
    found = folder(XDG_CACHE_HOME=str(tmp_path))
    assert found.is_relative_to(tmp_path / "bridgegen")
    assert folder(HOME=str(tmp_path)).is_relative_to(tmp_path / ".cache" / "bridgegen")


FULL = """
import resource, signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))
"""


def test_a_full_disk_costs_the_cache_only(tmp_path):
    """A limit on file sizes stands for the full disk.

    Without bytecode: Python itself would leave truncated files beside the package's sources.
    """
    (tmp_path / "mine.py").write_text(MINE)
    environment = {"HOME": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1"}
    assert result(begin(FULL + COMPILES, tmp_path, **environment)) == "1"


def test_the_folder_is_the_same_whatever_the_source(folder, tmp_path):
    """What of it is used depends on the source: see test_sources."""
    shutil.copytree(Path(bridgegen.__file__).parent, tmp_path / "bridgegen")
    environment = {"PYTHONPATH": str(tmp_path), "HOME": str(tmp_path)}
    assert result(begin(FOLDER, **environment)) == str(folder(HOME=str(tmp_path)))


def test_the_user_may_say_where(folder, tmp_path):
    assert folder(NUMBA_CACHE_DIR=str(tmp_path / "mine")).is_relative_to(tmp_path / "mine")


@pytest.fixture
def no_home(tmp_path):
    """An environment in which the user's cache folder cannot be written; TMPDIR is ``tmp``."""
    blocked, shared = tmp_path / "file", tmp_path / "tmp"
    blocked.write_text("not a folder")
    shared.mkdir()
    return {"HOME": str(blocked), "XDG_CACHE_HOME": str(blocked), "TMPDIR": str(shared)}


def test_where_nothing_can_be_written_a_temporary_folder_serves(folder, no_home):
    shared = Path(no_home["TMPDIR"]) / f"bridgegen-{os.getuid()}"
    found = folder(**no_home)
    assert found.parent == shared
    assert stat.S_IMODE(shared.stat().st_mode) == 0o700
    assert folder(**no_home) == found


@pytest.mark.parametrize("trap", ["writable by all", "a link", "another user's"])
def test_what_somebody_else_may_have_written_is_not_read(folder, no_home, tmp_path, trap):
    """Numba unpickles what it finds: whoever wrote it would run code as this user."""
    shared = Path(no_home["TMPDIR"]) / f"bridgegen-{os.getuid()}"
    if trap == "a link":
        (tmp_path / "theirs").mkdir(mode=0o700)
        shared.symlink_to(tmp_path / "theirs")
    else:
        shared.mkdir(mode=0o700)
    if trap == "writable by all":
        shared.chmod(0o777)
    elif trap == "another user's":
        if os.getuid():
            pytest.skip("only root can give a folder away")
        os.chown(shared, 12345, 12345)
    found, other = folder(**no_home), folder(**no_home)
    assert not found.is_relative_to(shared)
    assert not found.resolve().is_relative_to(tmp_path / "theirs")
    assert found != other  # nobody can have foreseen it
    assert stat.S_IMODE(found.stat().st_mode) == 0o700


def test_a_home_cache_that_others_can_write_is_not_read(folder, tmp_path):
    home = {"XDG_CACHE_HOME": str(tmp_path / "cache"), "TMPDIR": str(tmp_path)}
    found = folder(**home)
    found.chmod(0o777)
    assert folder(**home).is_relative_to(tmp_path / f"bridgegen-{os.getuid()}")


@pytest.fixture
def mine(tmp_path):
    (tmp_path / "mine.py").write_text(MINE)
    return tmp_path


DAMAGES = """
import sys
import tempfile
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from numba.core import event

def compiles():
    sys.modules.pop("mine", None)  # its kernel is another object, without code of its own
    with event.install_recorder("numba:compile") as recorder:
        import mine
        assert mine.doubled(21.0) == 42.0
    return sum(one.is_start for _, one in recorder.buffer)

for suffix in ("nbi", "nbc"):
    for damage in (b"", bytes(512), b"\\x80\\x05not a pickle", None):
        (file,) = Path(sys.argv[1]).rglob(f"*.{suffix}")
        file.write_bytes(file.read_bytes()[:-9] if damage is None else damage)
        print(compiles(), compiles())
"""


def test_damaged_files_are_made_anew(mine):
    """Each import reads the files anew; a second process uses what the first one wrote."""
    home = {"XDG_CACHE_HOME": str(mine / "cache")}
    assert result(begin(COMPILES, mine, **home)) == "1"
    assert result(begin(DAMAGES, mine, **home)).splitlines() == ["1 0"] * 8
    assert result(begin(COMPILES, mine, **home)) == "0"


def test_of_four_first_runs_at_once_one_compiles(mine):
    home = {"XDG_CACHE_HOME": str(mine / "cache")}
    runs = [begin(COMPILES, mine, **home) for _ in range(4)]
    assert sorted(result(run) for run in runs) == ["0", "0", "0", "1"]


def test_the_place_of_the_package_does_not_matter(tmp_path):
    """A new virtual environment finds what an earlier one has compiled."""
    code = (
        "from bridgegen.assess.metrics import _kernels as k\n"
        "one = next(v for v in vars(k).values() if hasattr(v, '_cache'))\n"
        "print(one._cache.cache_path, one._cache._impl.locator.get_source_stamp())"
    )
    here = Path(bridgegen.__file__).parent
    shutil.copytree(here, tmp_path / "elsewhere" / "bridgegen")
    home = {"XDG_CACHE_HOME": str(tmp_path / "cache")}
    found = {
        result(begin(code, PYTHONPATH=str(place), **home))
        for place in (here.parent, tmp_path / "elsewhere")
    }
    assert len(found) == 1
    assert found.pop().startswith(str(tmp_path / "cache"))
