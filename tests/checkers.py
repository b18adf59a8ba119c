"""Strangers that judge our files: the ASAM quality checkers and SUMO's netconvert.

They live in a virtual environment of their own, because their pins clash with ours; the
environment variable ``BRIDGEGEN_CHECKERS`` says where. Tests get a `Checkers` from the fixture
``checkers`` and are marked ``@pytest.mark.checkers``.
"""

import resource
import subprocess
from dataclasses import dataclass
from pathlib import Path

from lxml import etree

_RUN = """
import logging, sys
logging.disable(logging.CRITICAL)
from qc_baselib import Configuration, Result
from {package} import constants
from {package}.main import run_checks
for path, out in zip(sys.argv[1::2], sys.argv[2::2]):
    config, result = Configuration(), Result()
    config.set_config_param("InputFile", path)
    result.register_checker_bundle(
        name=constants.BUNDLE_NAME, description="", version=constants.BUNDLE_VERSION, summary=""
    )
    result.set_result_version(version=constants.BUNDLE_VERSION)
    run_checks(config, result)
    result.write_to_file(out)
"""

# What a checker says of itself where its rule is for another version of the standard.
_OTHER_VERSION = ("is not valid according to", "is lower than definition setting")


@dataclass(frozen=True)
class Report:
    """What the quality checkers say of one file.

    Attributes:
        completed: ids of the checkers that ran to their end.
        incomplete: ids of those that did not (skipped for want of a precondition, or crashed),
            with their summary; those whose rule is for another version are left out.
        errors: "checker: description" of every issue of level error.
        warnings: the same of level warning.
    """

    completed: tuple[str, ...]
    incomplete: tuple[str, ...]
    errors: tuple[str, ...]
    warnings: tuple[str, ...]

    @property
    def clean(self) -> bool:
        """No errors, and every checker came to its end."""
        return bool(self.completed) and not self.incomplete and not self.errors


@dataclass(frozen=True)
class Checkers:
    """The tools of one virtual environment."""

    venv: Path

    def qc_opendrive(self, *paths: Path) -> list[Report]:
        """Run the ASAM checkers for OpenDRIVE on some files, in one process."""
        return self._quality("qc_opendrive", paths)

    def qc_openscenario(self, *paths: Path) -> list[Report]:
        """Run the ASAM checkers for OpenSCENARIO XML on some files, in one process."""
        return self._quality("qc_openscenario", paths)

    def schema(self, package: str, name: str) -> etree.XMLSchema:
        """Return a schema that a checker brings, as in ``("qc_opendrive", "1.7.0/x.xsd")``."""
        return etree.XMLSchema(etree.parse(self.schema_path(package, name)))

    def schema_path(self, package: str, name: str) -> Path:
        """Return where that schema lies."""
        (found,) = self.venv.glob(f"lib/python*/site-packages/{package}/schema/{name}")
        return found

    def netconvert(self, path: Path, *, seconds: float = 60.0) -> subprocess.CompletedProcess[str]:
        """Convert an OpenDRIVE file to a SUMO network beside it, in at most 2 GiB of memory."""

        def limit() -> None:
            resource.setrlimit(resource.RLIMIT_AS, (2 * 2**30, 2 * 2**30))

        return subprocess.run(
            [
                self.venv / "bin/netconvert",
                "--opendrive-files", path,
                "-o", path.with_suffix(".net.xml"),
            ],
            capture_output=True, text=True, timeout=seconds, preexec_fn=limit, check=False,
        )  # fmt: skip

    def _quality(self, package: str, paths: tuple[Path, ...]) -> list[Report]:
        results = [path.with_name(path.name + ".xqar") for path in paths]
        pairs = [str(one) for pair in zip(paths, results, strict=True) for one in pair]
        subprocess.run(
            [self.venv / "bin/python", "-c", _RUN.format(package=package), *pairs],
            capture_output=True, text=True, timeout=300, check=True,
        )  # fmt: skip
        return [_report(result) for result in results]


def _report(path: Path) -> Report:
    completed, incomplete, errors, warnings = [], [], [], []
    for checker in etree.parse(path).iter("Checker"):
        name, status = checker.get("checkerId", ""), checker.get("status")
        summary = checker.get("summary", "")
        if status == "completed":
            completed.append(name)
        elif status != "skipped" or not any(text in summary for text in _OTHER_VERSION):
            incomplete.append(f"{name}: {status}: {summary}")
        for issue in checker.iter("Issue"):
            level = {"1": errors, "2": warnings}.get(issue.get("level", ""))
            if level is not None:
                level.append(f"{name}: {issue.get('description')}")
    return Report(tuple(completed), tuple(incomplete), tuple(errors), tuple(warnings))
