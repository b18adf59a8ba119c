"""Reading XML from strangers: no entities, no DTD, no network, bounded size and depth."""

import stat
from pathlib import Path

from lxml import etree

from bridgegen.base.errors import FileFormatError

# Far above real maps (CARLA's Town05, as individuals with all its lines, has 3.6 MB): the limit is
# for files that only pretend to be maps.
MAX_BYTES = 64 * 2**20
MAX_DEPTH = 64


def parse_xml(source: Path | bytes, place: str | None = None) -> etree._Element:
    """Return the root element of an XML file or text.

    Args:
        source: a path, or the document itself.
        place: what to call it in messages; the path by default.

    Raises:
        FileFormatError: missing, unreadable, malformed, larger than 64 MiB, deeper than 64
            levels, or with a DOCTYPE (entities and external references are never resolved).
    """
    place = place or (str(source) if isinstance(source, Path) else "document")
    data = read_bytes(source, place) if isinstance(source, Path) else source
    # The size is tested before lxml sees the data: its tree takes several times the text's memory.
    if len(data) > MAX_BYTES:
        raise FileFormatError(f"{place}: an XML file may have {MAX_BYTES} bytes, got {len(data)}")
    parser = etree.XMLParser(
        # Any of these alone stops one attack only: entities that expand to gigabytes, files of this
        # machine that an external entity names, and addresses that a DTD lets the reader call.
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        huge_tree=False,
        # Without comments and processing instructions every node is an element, so readers need not
        # ask.
        remove_comments=True,
        remove_pis=True,
    )
    try:
        root = etree.fromstring(data, parser)
    except (etree.XMLSyntaxError, ValueError) as error:
        text = str(error).partition(" (<string>")[0]
        raise FileFormatError(f"{place}: not well-formed XML: {text}") from None
    # Refused, and not ignored: a file whose meaning depends on entities would be read as another
    # one.
    if root.getroottree().docinfo.doctype:
        raise FileFormatError(f"{place}: a DOCTYPE is refused (entities are never expanded)")
    _check_depth(root, place)
    return root


def read_bytes(path: Path, place: str | None = None, limit: int = MAX_BYTES) -> bytes:
    """Return a file's bytes, or one clear error.

    Raises:
        FileFormatError: missing, no regular file (a folder, a device, a pipe), not readable, or
            larger than ``limit`` bytes.
    """
    place = place or str(path)
    try:
        about = path.stat()
        # A pipe or a device, named as a map, would be read for ever; `open` alone does not refuse
        # them.
        if not stat.S_ISREG(about.st_mode):
            what = "is a folder" if stat.S_ISDIR(about.st_mode) else "is no regular file"
            raise FileFormatError(f"{place}: cannot be read: {what}")
        if about.st_size > limit:
            raise FileFormatError(f"{place}: may have at most {limit} bytes, got {about.st_size}")
        with path.open("rb") as file:
            # One byte more than allowed: the size that `stat` gave may be out of date, see below.
            data = file.read(limit + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise FileFormatError(f"{place}: cannot be read: {reason}") from None
    if len(data) > limit:  # it has grown, or is one of the system's that say 0
        raise FileFormatError(f"{place}: may have at most {limit} bytes, got more")
    return data


def _check_depth(root: etree._Element, place: str) -> None:
    # Level by level, without recursion: what measures the depth must not overflow the stack itself.
    # Readers recurse once per level, so this bound is theirs, too.
    level = [root]
    for _ in range(MAX_DEPTH):
        level = [child for element in level for child in element]
        if not level:
            return
    raise FileFormatError(
        f"{place}: elements may nest {MAX_DEPTH} deep, line {level[0].sourceline} is deeper"
    )
