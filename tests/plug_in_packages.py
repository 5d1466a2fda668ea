"""Installed packages with plug-ins."""

import sys
from pathlib import Path
from pkgutil import resolve_name
from textwrap import dedent

from study_app.discovery import REGISTRIES
from study_app.protocol.file_format.json_schema import schema

EXAMPLES = Path(__file__).parents[1] / "docs" / "examples"
TEMPLATE = EXAMPLES / "liquid_study_device"


def install(site: Path, package: str, kind: str, entry_points: dict[str, str], **modules: str) -> None:
    """Write an installed package with plug-ins of a kind: its modules and its metadata."""
    for name, source in modules.items():
        (site / f"{name}.py").write_text(dedent(source), encoding="utf-8", newline="\n")
    metadata = site / f"{package}-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n", encoding="utf-8", newline="\n"
    )
    points = "".join(f"{name} = {value}\n" for name, value in entry_points.items())
    (metadata / "entry_points.txt").write_text(f"[liquid_study.{kind}s]\n{points}", encoding="utf-8", newline="\n")


def forget_plug_ins(*packages: str) -> None:
    """Clear the plug-in registries, and remove these packages' modules from sys.modules."""
    for registry_name in REGISTRIES.values():
        if registry_name.partition(":")[0] in sys.modules:
            resolve_name(registry_name).forget()
    schema.cache_clear()
    for name in [name for name in sys.modules if name.startswith(packages)]:
        del sys.modules[name]
