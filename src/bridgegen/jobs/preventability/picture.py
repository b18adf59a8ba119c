"""Classes of cells as pictures: a pixel a cell, in a PNG with a palette."""

import base64
import struct
import zlib

from bridgegen.jobs.preventability.classes import CellClass, Codes

COLOURS = {
    CellClass.AVOIDED: "#56b4e9",
    CellClass.PREVENTABLE: "#d55e00",
    CellClass.UNPREVENTABLE: "#3d3d3d",
    CellClass.NOT_APPLICABLE: "#c9ced6",
    CellClass.NO_RESULT: "#cc79a7",
}
"""The colour of each class, distinct for the colour-blind and in grey.

Source: Okabe and Ito, Color Universal Design (2008); greys of our own.
"""


def png(codes: Codes) -> bytes:
    """Return a picture.

    Args:
        codes: ``(height, width)``, a `CellClass` each, the uppermost row first.
    """
    height, width = codes.shape
    palette = b"".join(bytes.fromhex(COLOURS[one][1:]) for one in CellClass)
    lines = b"".join(b"\0" + row.astype("u1").tobytes() for row in codes)
    header = struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        _chunk(kind, data)
        for kind, data in (
            (b"IHDR", header),
            (b"PLTE", palette),
            (b"IDAT", zlib.compress(lines, 9)),
            (b"IEND", b""),
        )
    )


def data_uri(codes: Codes) -> str:
    """Return a picture as the address of itself; see `png`."""
    return "data:image/png;base64," + base64.b64encode(png(codes)).decode("ascii")


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
