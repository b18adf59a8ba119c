"""``bridgegen safety-case``: writes the case, its page, and the script that recomputes it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path

from bridgegen.base.disk import write_whole
from bridgegen.base.errors import InputError, StorageError
from bridgegen.jobs.safety_case.case import build
from bridgegen.jobs.safety_case.facts import read_facts
from bridgegen.jobs.safety_case.model import FILE, SafetyCase
from bridgegen.jobs.safety_case.page import PAGE, page
from bridgegen.search.triage.record import NOT_JUDGED

FOLDER, SCRIPT = "safety-case", "recompute.py"


@dataclass(frozen=True)
class Exported:
    """A safety case on disk.

    Attributes:
        case: its content.
        folder: that holds its files.
        page: of it.
        unjudged: by folder of a run that could not be judged, why: no claim on its ego is
            supported.
    """

    case: SafetyCase
    folder: Path
    unjudged: Mapping[Path, str] = field(default_factory=dict)

    @property
    def page(self) -> Path:
        """The page."""
        return self.folder / PAGE

    @property
    def file(self) -> Path:
        """Its JSON file."""
        return self.folder / FILE

    @property
    def script(self) -> Path:
        """What recomputes it."""
        return self.folder / SCRIPT


def export_safety_case(runs: Sequence[Path | str], out: Path | None = None) -> Exported:
    """Write the safety case of finished runs; the same runs give the same bytes.

    Args:
        runs: folders, at least one; each once.
        out: the folder to write to; ``safety-case`` in the run's folder by default, and in the
            working directory for several runs.

    Raises:
        InputError: no run, one given twice, or one that cannot be argued about: not finished,
            without a triage, or of a version that recorded too little.
        FileFormatError: a record of a run is damaged, or another run's.
        StorageError: not a run, damaged or changed since; or the files cannot be written.
    """
    folders = [Path(one) for one in runs]
    if not folders:
        raise InputError("a safety case is of one run at least, got none")
    seen: set[Path] = set()
    for one in folders:
        if one.resolve() in seen:
            raise InputError(f"{one}: a safety case takes each run once, and it is given twice")
        seen.add(one.resolve())
    folder = out or (folders[0] / FOLDER if len(folders) == 1 else Path(FOLDER))
    found = [read_facts(one) for one in folders]
    if folder.resolve() in seen:
        raise InputError(f"{folder}: is the folder of a run; choose another --out")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StorageError(f"{folder}: cannot be written: {error.strerror}") from None
    case = build(found, folder)
    data = case.model_dump_json(indent=1).encode() + b"\n"
    write_whole(folder / FILE, [data])
    write_whole(folder / PAGE, page(case, data))
    write_whole(
        folder / SCRIPT, [files("bridgegen.jobs.safety_case").joinpath(SCRIPT).read_bytes()]
    )
    unjudged = {
        one.run.folder: one.triage.bound.sentence for one in found if one.run.verdict == NOT_JUDGED
    }
    return Exported(case, folder, unjudged)
