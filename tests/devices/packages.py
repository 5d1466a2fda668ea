"""Packages with devices, as an installer leaves them."""

from pathlib import Path

TEMPLATE = Path(__file__).parents[2] / "docs" / "examples" / "liquid_study_device"


def install_metadata(site: Path, package: str, version: str, entry_points: dict[str, str]) -> None:
    """Write the metadata of an installed package."""
    metadata = site / f"{package}-{version}.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: {version}\n")
    points = "".join(f"{name} = {value}\n" for name, value in entry_points.items())
    (metadata / "entry_points.txt").write_text(f"[liquid_study.devices]\n{points}")
