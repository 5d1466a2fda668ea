"""Templates of studies: complete studies from which new ones are made."""

from pathlib import Path
from typing import Final

FOLDER: Final = Path(__file__).parent

QUESTIONS: Final[dict[str, tuple[tuple[str, tuple[str, ...]], ...]]] = {
    "compare-liquids": (("Repetitions", ("blocks", "liquids", "repetitions")),),
    "viscosity-jnd": (
        ("Standards", ("stimuli", "damping", "standards")),
        ("Trials per standard", ("methods", "adaptive", "trials")),
    ),
    "delay-detection": (
        ("Delays (from, to)", ("stimuli", "delay", "levels")),
        ("Trials", ("methods", "adaptive", "trials")),
    ),
    "two-liquids-abx": (("Trials", ("blocks", "liquids", "repetitions")),),
    "rate-realism": (("Repetitions", ("blocks", "liquids", "repetitions")),),
}
"""The questions of a template besides title, name and languages: text, and path of the value."""


def templates() -> tuple[str, ...]:
    """Return the names of the templates, sorted."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))
