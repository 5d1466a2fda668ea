"""Inter (SIL Open Font License) from the package's own files, and the type scale: one role, one font.

Sizes are logical px, so that they grow with the screen's scaling and with nothing else.
"""

from dataclasses import dataclass
from functools import cache, lru_cache
from importlib import resources
from typing import Literal, TypeAlias

from PySide6.QtGui import QFont, QFontDatabase

FAMILIES = ["Inter", "Noto Sans", "DejaVu Sans"]
FILES = ("Inter-Regular.otf", "Inter-Medium.otf", "Inter-SemiBold.otf", "Inter-Bold.otf")

TypeRole: TypeAlias = Literal[
    "display", "title", "title_dense", "number", "card", "body", "strong", "label", "small", "key",
    "instruction", "statement", "cell", "chosen",
]  # fmt: skip


@dataclass(frozen=True, slots=True)
class Type:
    """A step of the type scale: size [logical px], weight, and whether figures share one width."""

    size: float
    weight: int
    tabular: bool = False


TYPE: dict[TypeRole, Type] = {
    "display": Type(34, 600),
    "title": Type(28, 600),
    "title_dense": Type(24, 600),
    "number": Type(26, 600, tabular=True),
    "card": Type(16, 600),
    "body": Type(15, 400),
    "strong": Type(15, 600),
    "label": Type(13, 500),
    "small": Type(12, 400),
    "key": Type(11, 600),
    # the participant's
    "instruction": Type(30, 500),
    "statement": Type(16, 400),
    "cell": Type(16, 500, tabular=True),
    "chosen": Type(18, 700, tabular=True),
}


@cache
def load_fonts() -> tuple[str, ...]:
    """Register the package's fonts with Qt, once; return the families they bring (a QApplication must exist)."""
    families: list[str] = []
    for name in FILES:
        content = resources.files("study_app.gui").joinpath("assets", "fonts", name).read_bytes()
        number = QFontDatabase.addApplicationFontFromData(content)
        families += QFontDatabase.applicationFontFamilies(number)
    return tuple(dict.fromkeys(families))


def font(role: TypeRole, *, scale: float = 1.0, weight: int | None = None, tabular: bool | None = None) -> QFont:
    """Return the font of a role.

    Parameters
    ----------
    scale : float
        Factor on the size, for pages that grow with their window.
    weight, tabular : int, bool, optional
        In place of the role's own: 400, 500, 600, 700; figures of one width.
    """
    step = TYPE[role]
    chosen = step.weight if weight is None else weight
    return QFont(_made(max(1, round(step.size * scale)), chosen, tabular=step.tabular if tabular is None else tabular))


@lru_cache(maxsize=256)
def _made(size_px: int, weight: int, *, tabular: bool) -> QFont:
    """Return a shared font; copy it before changing it."""
    load_fonts()
    made = QFont(FAMILIES)
    made.setPixelSize(size_px)
    made.setWeight(QFont.Weight(weight))
    made.setHintingPreference(QFont.HintingPreference.PreferNoHinting)
    if tabular:
        made.setFeature(QFont.Tag("tnum"), 1)
    return made
