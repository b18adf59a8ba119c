"""All formats of recordings; a new one is a file here and an entry of `FORMATS`."""

from collections.abc import Iterator
from pathlib import Path

from bridgegen.base.errors import FileFormatError
from bridgegen.recordings.readers import (
    argoverse,
    commonroad,
    esmini_dat,
    interaction,
    levelx,
    ngsim,
    osi,
    scenarionet,
    smarts,
    states,
    sumo_fcd,
    womd_json,
)
from bridgegen.recordings.readers.format import Format, Head, read_head
from bridgegen.recordings.readers.table import RecordedTraffic

FORMATS: tuple[Format, ...] = (
    states.FORMAT,
    levelx.FORMAT,
    ngsim.FORMAT,
    smarts.FORMAT,
    commonroad.FORMAT,
    interaction.FORMAT,
    sumo_fcd.FORMAT,
    womd_json.FORMAT,
    argoverse.FORMAT,
    scenarionet.FORMAT,
    osi.FORMAT,
    esmini_dat.FORMAT,
)
"""Formats of recordings; no file is of more than one of them."""

ARCHIVES = {
    b"PK\x03\x04": "zip",
    b"\x1f\x8b": "gzip",
    b"BZh": "bzip2",
    b"\xfd7zXZ\x00": "xz",
    b"7z\xbc\xaf\x27\x1c": "7z",
    b"Rar!": "rar",
}


def recognise(head: Head) -> Format | None:
    """Return the format of a file, by its content; None if it is of none."""
    return next((format_ for format_ in FORMATS if format_.recognises(head)), None)


def read(path: Path) -> Iterator[RecordedTraffic]:
    """Yield the recordings in a file.

    Raises:
        FileFormatError: of no format that is known, or breaks its format's rules; with the line.
        InputError: an extra is not installed that the format needs.
    """
    head = read_head(path)
    found = recognise(head)
    if found is not None:
        yield from found.read(path)
        return
    for sign, name in ARCHIVES.items():
        if head.data.startswith(sign):
            raise FileFormatError(f"{path}: is an archive ({name}); unpack it, and name its files")
    if b"ustar" in head.data[257:263]:
        raise FileFormatError(f"{path}: is an archive (tar); unpack it, and name its files")
    if head.data.startswith(b"version https://git-lfs"):
        raise FileFormatError(
            f"{path}: is a Git LFS pointer, not the file that it stands for: run 'git lfs pull'"
        )
    for format_ in FORMATS:
        if format_.companion(head):
            raise FileFormatError(
                f"{path}: belongs to a recording ({format_.title}) and is none itself"
            )
    names = ", ".join(format_.title for format_ in FORMATS)
    raise FileFormatError(f"{path}: is a recording of no known format; known: {names}")


def files_of(path: Path) -> tuple[list[Path], list[Path]]:
    """Return the recordings at a path, and what else is there.

    Args:
        path: a file, which is returned whatever it is; or a folder, of which the files are
            looked at, and those of its folders are not.

    Raises:
        FileFormatError: the folder holds no recording, or cannot be read.
    """
    if not path.is_dir():
        return [path], []
    try:
        files = sorted(item for item in path.iterdir() if item.is_file())
    except OSError as error:
        raise FileFormatError(f"{path}: cannot be read: {error.strerror}") from None
    recordings, others = [], []
    for file in files:
        try:
            head = read_head(file)
        except FileFormatError:
            others.append(file)
            continue
        if recognise(head) is not None:
            recordings.append(file)
        elif not any(format_.companion(head) for format_ in FORMATS):
            others.append(file)
    if not recordings:
        raise FileFormatError(f"{path}: the folder holds no recording of a known format")
    return recordings, others
