"""What ``bridgegen doctor`` says of an installation."""

import json
import re
import subprocess
import sys
import tomllib
from importlib.metadata import version
from pathlib import Path

import pytest
from tests.approval import approve

from bridgegen.base.compilation import cache, folder
from bridgegen.base.compilation.folder import digest
from bridgegen.base.errors import InputError
from bridgegen.base.extras import EXTRAS, Extra, is_installed, require
from bridgegen.cli import installation
from bridgegen.cli.installation import Finding, examine
from bridgegen.engine import conformance

pytestmark = pytest.mark.thorough

PROJECT = Path(__file__).parents[1] / "pyproject.toml"


def by_subject() -> dict[str, Finding]:
    return {one.subject: one for one in examine()}


def test_the_command_prints_what_is_installed(cli, monkeypatch, tmp_path):
    monkeypatch.delenv("ESMINI_LIB", raising=False)
    code, out, _ = cli("doctor", "--json")
    assert code == 0
    rows = {row["subject"]: row for row in json.loads(out)}
    assert rows["bridgegen"]["value"] == version("bridgegen")
    assert rows["numba"]["value"] == version("numba")
    assert "https://github.com/esmini/esmini/releases" in rows["esmini"]["advice"]
    monkeypatch.setenv("COLUMNS", "300")  # nothing is folded
    code, out, _ = cli("doctor")
    assert code == 0
    assert all(subject in out for subject in rows)


def test_its_extras_are_those_of_the_project_that_users_install():
    """Those for developers are left out."""
    project = tomllib.loads(PROJECT.read_text("utf-8"))["project"]
    declared = project["optional-dependencies"]
    assert set(EXTRAS) == set(declared) - {"test", "docs", "browser"}
    modules = {  # other names
        "comma-deps-acados": "acados",
        "fiss-planner": "fiss_planner",
        "grpcio": "grpc",
        "highway-env": "highway_env",
        "jpype1": "jpype",
        "metadrive-simulator": "metadrive",
        "rerun-sdk": "rerun",
        "stable-baselines3": "stable_baselines3",
    }
    for extra, (needed, _) in EXTRAS.items():
        named = {re.match(r"[\w-]+", one)[0] for one in declared[extra]}
        assert set(needed) == {modules.get(one, one) for one in named}


@pytest.mark.parametrize("extra", EXTRAS)
def test_where_an_extra_is_missing_one_sentence_names_it(extra, monkeypatch):
    monkeypatch.setitem(EXTRAS, extra, Extra(("json", "no_such_module"), "a test"))
    assert not is_installed(extra)
    with pytest.raises(InputError) as error:
        require(extra, "this")
    approve(str(error.value), extra)


def test_only_data_frames_need_pandas(tmp_path):
    """A search, its figure and what a notebook shows of it do without pandas."""
    code = f"""
import sys
sys.modules["pandas"] = None
import bridgegen as bg
from bridgegen.base.errors import InputError
run = bg.run_search(
    "crossroads-s4", algorithm="random", budget=20, triage="none", out={str(tmp_path / "run")!r}
)
run.plot()
assert "crossroads-s4" in run._repr_html_()
assert len(run.rows().X) == 20
try:
    run.frame()
except InputError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", code], text=True, capture_output=True)
    assert done.returncode == 0, done.stderr
    approve(done.stdout.splitlines()[-1], "pandas")


def test_what_is_missing_is_a_problem_with_its_remedy(monkeypatch, tmp_path, cli):
    monkeypatch.setenv("ESMINI_LIB", str(tmp_path / "gone.so"))
    monkeypatch.setattr(installation, "LIBRARIES", ("numpy", "not-there"))
    found = by_subject()
    assert found["esmini"].is_problem
    approve(found["esmini"].value)
    approve(found["not-there"].advice, "not-there")
    assert not found["numpy"].is_problem
    assert cli("doctor")[0] == 2


@pytest.mark.parametrize("name", ["numpy", "numba"])
def test_the_requirement_of_a_package(name):
    assert re.fullmatch(rf"{name}[<>=].*", installation._requirement(name))


def test_a_cache_that_cannot_be_kept_is_a_problem(monkeypatch, tmp_path):
    kept, lost = tmp_path / "kernels-1", tmp_path / "bridgegen-1"
    monkeypatch.setattr(folder, "cache_folder", lambda: lost)
    assert by_subject()["compiled code"].is_problem
    monkeypatch.setattr(folder, "cache_folder", lambda: kept)
    monkeypatch.setattr(cache, "cache_folder", lambda: kept)
    empty = by_subject()["compiled code"]
    assert not empty.is_problem
    assert empty.value == f"{kept}, empty"
    main = kept / f"simulation.embedded._rollout_kernels-{digest(cache.MAIN)}"
    main.mkdir(parents=True)
    (main / "a.nbi").touch()
    assert by_subject()["compiled code"] == Finding("compiled code", str(kept))


def test_a_wheel_carries_every_file_of_the_package():
    """Suffixes of any folder, so that a new package's page is not forgotten."""
    package = PROJECT.parent / "src" / "bridgegen"
    patterns = tomllib.loads(PROJECT.read_text("utf-8"))["tool"]["setuptools"]["package-data"]
    carried = {path for pattern in patterns["bridgegen"] for path in package.glob(pattern)}
    development = {package / "pages/web" / name for name in ("jsconfig.json", "page.d.ts")}
    found = {
        path
        for path in package.rglob("*")
        if path.is_file() and path.suffix not in (".py", ".pyc", ".nbi", ".nbc")
    }
    assert found - carried == development


def test_this_machine_gives_the_published_bits():
    assert conformance.differences() == []


def test_other_bits_are_named(monkeypatch):
    published = conformance.published()
    published["functions"]["sin"] = published["rows"]["crossroads-s4 route-follower"] = "0"
    monkeypatch.setattr(conformance, "published", lambda: published)
    (found,) = (item for item in examine() if item.subject == "bits")
    assert found.value == (
        "not the published ones: sin, motion or metrics of crossroads-s4 with route-follower"
    )
    assert found.advice
    assert not found.is_problem
