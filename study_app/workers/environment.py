"""The environment on which a case's result depends: the program's files, Python and the numerical libraries."""

import hashlib
import platform
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Final

import study_app

LIBRARIES: Final = ("numpy", "scipy", "numba", "pandas", "ngsolve")
_PACKAGE: Final = Path(study_app.__file__).resolve().parent
_ENDINGS: Final = (".py", ".csv", ".toml")


@cache
def environment() -> Mapping[str, str]:
    """Return the versions by name; that of the program is followed by a digest of its files and shipped protocols."""
    digest = hashlib.sha256()
    for name, path in _files():
        digest.update(name.encode())
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return {
        "liquid-study": f"{study_app.__version__} ({digest.hexdigest()[:16]})",
        "Python": platform.python_version(),
        **{name: _version(name) for name in LIBRARIES},
    }


def environment_digest() -> str:
    """Return a digest of `environment`."""
    return hashlib.sha256(repr(sorted(environment().items())).encode()).hexdigest()[:16]


def difference(other: Mapping[str, str]) -> str:
    """Return a description of how another environment differs from this one; empty if it does not."""
    own = environment()
    return "; ".join(
        f"{name} {own.get(name, 'missing')} instead of {other.get(name, 'missing')}"
        for name in sorted({*own, *other})
        if own.get(name) != other.get(name)
    )


def _files() -> Iterator[tuple[str, Path]]:
    """Yield the files of the package and the shipped protocols with their names in it, in one order.

    The protocols are inside an installed package, and next to that of a checkout.
    """
    shipped = () if (_PACKAGE / "protocols").is_dir() else (_PACKAGE.parent / "protocols").glob("*.toml")
    files = {path.relative_to(_PACKAGE).as_posix(): path for path in _PACKAGE.rglob("*") if path.suffix in _ENDINGS}
    files |= {f"protocols/{path.name}": path for path in shipped}
    yield from sorted(files.items())


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "not installed"
