"""Model → OpenDRIVE text. Numbers are written in full, so reading gives back the same model."""

from typing import Any

from lxml import etree

from bridgegen.base.errors import InputError
from bridgegen.openx.opendrive.declaration import plan
from bridgegen.openx.opendrive.mirror import as_written
from bridgegen.openx.opendrive.model import OpenDrive


def to_xml(model: OpenDrive) -> bytes:
    """Return the text of a road network; a mirrored one is mirrored back.

    Raises:
        InputError: a name holds a character that XML cannot.
    """
    root = etree.Element("OpenDRIVE")
    try:
        _fill(root, as_written(model))
    # lxml refuses what XML has no characters for (NUL, lone surrogates); names come from users.
    except ValueError as error:
        raise InputError(f"the road network cannot be written as XML: {error}") from None
    return bytes(etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True))


def _fill(element: etree._Element, record: Any) -> None:
    wrappers: dict[tuple[str, ...], etree._Element] = {(): element}
    cls: type = type(record)
    for field in plan(cls):
        value = getattr(record, field.name)
        # What a file need not have is not written, so that OpenDRIVE to model and back adds
        # nothing.
        if value is None or value == ():
            continue
        role, path = field.form.role, field.form.path
        if role == "attribute":
            element.set(path[0], _text(value))
            continue
        if role == "choice":
            _fill(etree.SubElement(element, value.TAG), value)
            continue
        # Children that share a wrapper (``link/predecessor`` and ``link/successor``) get one
        # wrapper, as the XSD has it.
        for depth in range(1, len(path)):
            if path[:depth] not in wrappers:
                parent = wrappers[path[: depth - 1]]
                wrappers[path[:depth]] = etree.SubElement(parent, path[depth - 1])
        parent = wrappers[path[:-1]]
        for item in value if isinstance(value, tuple) else (value,):
            below = etree.SubElement(parent, path[-1])
            if role == "ids":
                below.set("id", _text(item))
            elif role == "text":
                below.text = item
            else:
                _fill(below, item)


def _text(value: float | int | bool | str) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return value
    # `repr` gives the shortest text that reads back to the same bits, so that model → text → model
    # is the identity. NumPy's scalars would print with their type's name; hence the conversion.
    return repr(float(value)) if isinstance(value, float) else repr(int(value))
