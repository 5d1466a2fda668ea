"""Upgrading study and scene files of format 1 to the current format, with the same meaning and comments.

Only two defaults differ: in format 1, an omitted ``scene.velocity`` means "ewma", and ``effects = "auto"`` never
selects unsteady drag. Upgraded files state both.
"""

import tomllib
from collections.abc import Mapping
from typing import Any, Final

from study_app.errors import Problem, ProtocolError
from study_app.protocol.load import read_document
from study_app.protocol.model import FORMAT
from study_app.protocol.source.document import entries, frozen, scan_nodes
from study_app.protocol.source.files import TABLE, StudySource, without_byte_order_mark

_OLD_VELOCITY: Final = 'kind = "ewma"\n'
_OLD_ACCURACY: Final = 'without = ["unsteady_drag"]\n'


def needs_upgrade(document: Mapping[str, Any]) -> bool:
    """Return whether a study or scene file is of format 1, which is also the format of files without a number."""
    return type(document.get("format", 1)) is int and document.get("format", 1) == 1


def upgraded_tables(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return the tables of a file of format 1, or of a receipt's protocol, in the current format."""
    scene = dict(document.get("scene", {}))
    scene.setdefault("velocity", frozen(tomllib.loads(_OLD_VELOCITY)))
    texts = (frozen(tomllib.loads(text)) for text in document.get(TABLE, {}).values())
    if any(effects == "auto" for table in (document, *texts) for _, effects in entries(table, "liquids.*.effects")):
        scene["accuracy"] = {**scene.get("accuracy", {}), **frozen(tomllib.loads(_OLD_ACCURACY))}
    return {**document, "format": FORMAT, "scene": scene}


def upgraded_file(source: bytes, name: str) -> bytes:
    """Return the file in a source of format 1 (`source.files`) in the current format.

    Raises
    ------
    ProtocolError
        The file is not TOML, or has an inline table that would have to be extended.
    """
    document, _ = read_document(source, name)
    expected = {key: value for key, value in upgraded_tables(document).items() if key != TABLE}
    content = without_byte_order_mark(StudySource.split(source).file)
    text = content.decode().replace("\r\n", "\n")
    nodes = {node.path: node for node in scan_nodes(text)}
    if expected["scene"].get("accuracy") != document.get("scene", {}).get("accuracy"):
        if (accuracy := nodes.get(("scene", "accuracy"))) is None:
            text = f"{text.rstrip()}\n\n[scene.accuracy]\n{_OLD_ACCURACY}"
        else:
            line_end = f"{text}\n".index("\n", accuracy.end)
            text = f"{text[:line_end]}\n{_OLD_ACCURACY.rstrip()}{text[line_end:]}"
    if "velocity" not in document.get("scene", {}):
        text = f"{text.rstrip()}\n\n[scene.velocity]\n{_OLD_VELOCITY}"
    format_node = nodes.get(("format",))
    text = (
        f"{text[: format_node.value]}{FORMAT}{text[format_node.end :]}"
        if format_node is not None
        else f"format = {FORMAT}\n{text}"
    )
    upgraded = text.replace("\n", "\r\n") if b"\r\n" in content else text
    try:
        is_same = read_document(upgraded.encode(), name)[0] == expected
    except ProtocolError:
        is_same = False
    if not is_same:
        hint = "write [scene], [scene.velocity] and [scene.accuracy] as tables with headers"
        raise ProtocolError(
            name, (Problem("scene", "is an inline table, which the program cannot upgrade", hint=hint),)
        )
    return upgraded.encode()
