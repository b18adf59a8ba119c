"""What a release states of itself: known faults, injected faults, coverage; and what it runs with.

``known-faults.yaml`` and ``release.json`` are data of the package; `sbom` reads what is installed.
"""

import hashlib
import json
from collections.abc import Iterable
from importlib.metadata import Distribution, distributions, version
from importlib.resources import files
from typing import Any
from urllib.parse import quote

import yaml
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name
from packaging.version import InvalidVersion, Version

SBOM = "sbom.cdx.json"

_HERE = files("bridgegen.jobs.credibility")


def known_faults(versions: Iterable[str]) -> list[dict[str, str]]:
    """Return the known faults that concern some versions; one that is no version: all."""
    faults: list[dict[str, str]] = yaml.safe_load((_HERE / "known-faults.yaml").read_text("utf-8"))

    def concerns(fault: dict[str, str], number: str) -> bool:
        try:
            return SpecifierSet(fault["versions"]).contains(Version(number), prereleases=True)
        except InvalidVersion:
            return True

    numbers = set(versions)
    return [fault for fault in faults if any(concerns(fault, number) for number in numbers)]


def release() -> dict[str, Any]:
    """Return what was measured for this release: injected faults, and coverage of tests."""
    found: dict[str, Any] = json.loads((_HERE / "release.json").read_text("utf-8"))
    return found


# --- A software bill of materials, CycloneDX 1.6 (ECMA-424) ---


def sbom() -> bytes:
    """Return the installed distributions as a CycloneDX 1.6 document in JSON, in a stable order.

    A component's hash is that of its record of files (RECORD), which holds theirs; a licence is
    what the distribution says of itself. No serial number and no date: the same environment has
    the same bytes.
    """
    parts = [_component(item) for item in distributions()]
    own = f"pkg:pypi/bridgegen@{quote(version('bridgegen'))}"
    document = {
        "$schema": "http://cyclonedx.org/schema/bom-1.6.schema.json",
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {"component": {"type": "application", "bom-ref": "tool", "name": "bridgegen",
                                   "version": version("bridgegen"), "purl": own}},
        "components": sorted({one["bom-ref"]: one for one in parts}.values(),
                             key=lambda one: one["bom-ref"]),
    }  # fmt: skip
    return json.dumps(document, indent=1).encode("ascii") + b"\n"


def _component(item: Distribution) -> dict[str, Any]:
    about: Any = item.metadata
    name, number = str(about["Name"] or "unnamed")[:200], str(item.version or "0")[:100]
    purl = "pkg:pypi/" + "@".join(quote(one, safe="") for one in (canonicalize_name(name), number))
    found: dict[str, Any] = {
        "type": "library", "bom-ref": purl, "name": name, "version": number, "purl": purl
    }  # fmt: skip
    if expression := about.get("License-Expression"):
        found["licenses"] = [{"expression": expression}]
    elif licence := (about.get("License") or "").strip().partition("\n")[0][:200]:
        found["licenses"] = [{"license": {"name": licence}}]
    if record := item.read_text("RECORD"):
        found["hashes"] = [
            {"alg": "SHA-256", "content": hashlib.sha256(record.encode()).hexdigest()}
        ]
    return found
