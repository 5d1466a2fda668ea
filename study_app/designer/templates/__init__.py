"""Templates: studies that work as they are, to begin one's own from."""

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
"""What a template asks beyond title, name and languages: words, and the key that holds the answer."""


def templates() -> tuple[str, ...]:
    """Return the names of the templates, sorted."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))
