"""Files become protocols: by path, or by name from ./protocols and then from those that ship with the program."""

from __future__ import annotations

import hashlib
import tomllib
from pathlib import Path

from study_app.errors import Problem, ProtocolError
from study_app.protocol.model import Protocol

_PACKAGE = Path(__file__).resolve().parent.parent
_SHIPPED = (_PACKAGE / "protocols", _PACKAGE.parent / "protocols")


def _find(name_or_path: str | Path) -> Path:
    path = Path(name_or_path)
    if path.is_file():
        return path
    for folder in (Path("protocols"), *_SHIPPED):
        if (found := folder / f"{path}.toml").is_file():
            return found
    raise ProtocolError(str(name_or_path), (Problem("file", "no such protocol"),))


def load(name_or_path: str | Path) -> Protocol:
    """Return the protocol."""
    return Protocol.model_validate(tomllib.loads(_find(name_or_path).read_text(encoding="utf-8")))


def source_bytes(name_or_path: str | Path) -> bytes:
    """Return the file as it is on disk."""
    return _find(name_or_path).read_bytes()


def protocol_hash(source: bytes) -> str:
    """Return the SHA-256 of a protocol's file, in hexadecimal."""
    return hashlib.sha256(source).hexdigest()
