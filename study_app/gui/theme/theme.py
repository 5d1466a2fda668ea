"""Fonts, palettes, spacing and the style sheet of every window.

Widgets select colours by role, never by value. The values are computed: the contrast satisfies WCAG 2.2 (tested), and
states and traces differ by CIEDE2000 distances in normal, protan, deutan and tritan vision. A state is always shown by
colour, icon and word.
"""

from dataclasses import dataclass
from functools import cache, lru_cache
from importlib import resources
from typing import Literal, TypeAlias

from PySide6.QtGui import QFont, QFontDatabase

FAMILIES = ["Inter", "Noto Sans", "DejaVu Sans"]
_FILES = ("Inter-Regular.otf", "Inter-Medium.otf", "Inter-SemiBold.otf", "Inter-Bold.otf")

TypeRole: TypeAlias = Literal[
    "display", "title", "title_dense", "number", "card", "body", "strong", "label", "small", "key",
    "instruction", "statement", "cell", "chosen",
]  # fmt: skip


@dataclass(frozen=True, slots=True)
class Type:
    """A step of the type scale: its size [logical px], weight, and whether figures have equal widths."""

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
    # the participant's pages
    "instruction": Type(30, 500),
    "statement": Type(16, 400),
    "cell": Type(16, 500, tabular=True),
    "chosen": Type(18, 700, tabular=True),
}


@cache
def load_fonts() -> tuple[str, ...]:
    """Register the package's fonts with Qt once; return their families (a QApplication must exist)."""
    families: list[str] = []
    for name in _FILES:
        content = resources.files("study_app.gui").joinpath("assets", "fonts", name).read_bytes()
        number = QFontDatabase.addApplicationFontFromData(content)
        families += QFontDatabase.applicationFontFamilies(number)
    return tuple(dict.fromkeys(families))


def font(role: TypeRole, *, scale: float = 1.0, weight: int | None = None, tabular: bool | None = None) -> QFont:
    """Return the font of a role.

    Parameters
    ----------
    scale : float
        Size factor, for pages that grow with their window.
    weight, tabular : int, bool, optional
        Weight (400, 500, 600 or 700) and tabular figures, if they differ from those of the role.
    """
    step = TYPE[role]
    chosen_weight = step.weight if weight is None else weight
    return QFont(
        _shared_font(
            max(1, round(step.size * scale)), chosen_weight, tabular=step.tabular if tabular is None else tabular
        )
    )


@lru_cache(maxsize=256)
def _shared_font(size_px: int, weight: int, *, tabular: bool) -> QFont:
    """Return a shared font; copy it before changing it."""
    load_fonts()
    shared = QFont(FAMILIES)
    shared.setPixelSize(size_px)
    shared.setWeight(QFont.Weight(weight))
    shared.setHintingPreference(QFont.HintingPreference.PreferNoHinting)
    if tabular:
        shared.setFeature(QFont.Tag("tnum"), 1)
    return shared


__all__ = [
    "DARK", "GRID", "LIGHT", "PARTICIPANT", "RADIUS_CARD", "RADIUS_CONTROL", "SPACE", "TANK", "TYPE",
    "TankColours", "Theme", "Tone", "Type", "TypeRole", "font", "load_fonts", "stylesheet",
]  # fmt: skip

Tone: TypeAlias = Literal["ok", "warn", "bad", "accent", "neutral"]
"""The tone of a message or state, which selects its colour."""

GRID = 4
SPACE = (4, 8, 12, 16, 24, 32, 40)
RADIUS_CONTROL = 8
RADIUS_CARD = 12
SHADOW = 3  # the width of a card's shadow, within its rectangle [px]


@dataclass(frozen=True, slots=True, kw_only=True)
class Theme:
    """Colours by role, as ``#RRGGBB``; ``dark`` selects the direction of hover and shadow.

    ``ctl`` is for edges of controls (≥ 3:1), ``border`` and ``grid`` are decorative; ``text3`` is never used on
    ``sunk``; ``stop`` is reserved for the force stop. ``hover`` is the fill of a control under the pointer,
    ``selected`` that of the current page.
    """

    name: str
    dark: bool
    window: str
    surface: str
    sunk: str
    hover: str
    selected: str
    text: str
    text2: str
    text3: str
    ctl: str
    border: str
    grid: str
    accent: str
    on_accent: str
    accent_hover: str
    ok: str
    ok_bg: str
    warn: str
    warn_bg: str
    bad: str
    bad_bg: str
    stop: str
    on_stop: str
    trace_x: str
    trace_y: str
    trace_z: str


LIGHT = Theme(
    name="light", dark=False,
    window="#F4F6F8", surface="#FFFFFF", sunk="#EDF1F4", hover="#F4F6F8", selected="#E3F0F9",
    text="#13202C", text2="#45535F", text3="#5D6A75",
    ctl="#7D8994", border="#DCE2E8", grid="#E6EBEF",
    accent="#0B65A3", on_accent="#FFFFFF", accent_hover="#0A5688",
    ok="#0A6E5C", ok_bg="#E0F3EE", warn="#8A5200", warn_bg="#FFF1D6", bad="#801226", bad_bg="#FBE7EA",
    stop="#BD1E1E", on_stop="#FFFFFF",
    trace_x="#0B65A3", trace_y="#B35600", trace_z="#13202C",
)  # fmt: skip

DARK = Theme(
    name="dark", dark=True,
    window="#0E141A", surface="#161E26", sunk="#1E2831", hover="#1E2831", selected="#16303F",
    text="#E9EFF4", text2="#B4C0CA", text3="#93A1AD",
    ctl="#6F7F8D", border="#2B3742", grid="#25303A",
    accent="#62B5EA", on_accent="#06182A", accent_hover="#86C6EF",
    ok="#5CCDB0", ok_bg="#12342F", warn="#F0B95B", warn_bg="#3A2C12", bad="#F5707A", bad_bg="#3A171C",
    stop="#C9302A", on_stop="#FFFFFF",
    trace_x="#62B5EA", trace_y="#F0A04B", trace_z="#E9EFF4",
)  # fmt: skip

# The participant's pages: always dark; a cell is a surface, its edge ``ctl``, the chosen cell ``accent``.
PARTICIPANT = Theme(
    name="participant", dark=True,
    window="#0E141A", surface="#161F27", sunk="#33424E", hover="#22303B", selected="#18222B",
    text="#EDF3F7", text2="#B9C6D0", text3="#98A7B3",
    ctl="#71818F", border="#222D37", grid="#1A232B",
    accent="#62B5EA", on_accent="#06182A", accent_hover="#86C6EF",
    ok="#5CCDB0", ok_bg="#12342F", warn="#F0B95B", warn_bg="#18222B", bad="#F5707A", bad_bg="#3A171C",
    stop="#C9302A", on_stop="#FFFFFF",
    trace_x="#62B5EA", trace_y="#F0A04B", trace_z="#E9EFF4",
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class TankColours:
    """The colours of the tank: cold greys that are the same for every liquid, so that they do not reveal it."""

    water_light: str = "#2F6079"
    glass: str = "#CFE6F2"
    proxy_light: str = "#FBC061"
    proxy: str = "#E8912A"
    lit: str = "#F4FBFF"
    dim: str = "#A9C4D4"
    shadow: str = "#06131C"
    tail_old: str = "#4E97C9"  # only in the lab: participants never see a tail
    tail: str = "#F4FBFF"
    wake: str = "#8FD0F5"


TANK = TankColours()


def stylesheet(theme: Theme) -> str:
    """Return the Qt style sheet of a window; fonts are set by widgets through `font`, never here.

    Dynamic properties select rules. A QPushButton is outlined by default, filled with ``role="primary"``, outlined in
    bad with ``"danger"``, without an edge with ``"plain"``, and the force stop with ``"stop"``. A QFrame is a card with
    ``role="card"``. A QLabel has the colour of its ``role``: text2, text3, ok, warn, bad or accent. Fields and buttons
    are compact with ``dense="true"``. The edge of a field is accent with ``state="changed"``, bad with ``"refused"``.
    """
    t = theme
    return "\n".join(
        (
            f"QWidget {{ color: {t.text}; }}",
            f"QMainWindow, QDialog, QWidget[role='window'] {{ background: {t.window}; }}",
            f"QFrame[role='card'] {{ background: {t.surface}; border: 1px solid {t.border};"
            f" border-radius: {RADIUS_CARD}px; }}",
            *(
                f"QLabel[role='{role}'] {{ color: {getattr(t, role)}; }}"
                for role in ("text2", "text3", "ok", "warn", "bad", "accent")
            ),
            f"QWidget[role='bar'], QWidget[role='rail'] {{ background: {t.surface}; }}",
            f"QWidget[role='bar'], QWidget[role='header'] {{ border-bottom: 1px solid {t.border}; }}",
            f"QWidget[role='rail'] {{ border-right: 1px solid {t.border}; }}",
            f"QWidget[role='rule'] {{ background: {t.border}; }}",
            *(f"QWidget[role='{tone} tint'] {{ background: {getattr(t, tone + '_bg')}; }}" for tone in ("bad", "warn")),
            f"QWidget[role$='tint'] {{ border-radius: {RADIUS_CARD}px; margin: 0 {SHADOW}px; }}",
            f"QWidget#earlier QLabel:disabled {{ color: {t.text3}; }}",
            "QListWidget { background: transparent; border: none; outline: none; }",
            f"QFrame[role='entry'] {{ border: 1px solid {t.ctl}; border-radius: {RADIUS_CONTROL}px; }}",
            f"QFrame[role='entry'][state='refused'] {{ border: 2px solid {t.bad}; }}",
            f"QListWidget::item {{ border-radius: {RADIUS_CONTROL}px; }}",
            f"QListWidget::item:selected {{ background: {t.selected}; }}",
            f"QListWidget[role='links']::item {{ border-radius: 6px; padding-left: 6px; color: {t.text}; }}",
            f"QListWidget[role='links']::item:selected {{ background: {t.selected}; color: {t.accent}; }}",
            _button_rules(t),
            _field_rules(t),
            _scroll_bar_rules(t),
            f"QProgressBar {{ background: {t.sunk}; border: none; border-radius: 4px; }}",
            f"QProgressBar::chunk {{ background: {t.accent}; border-radius: 4px; }}",
        )
    )


def _button_rules(t: Theme) -> str:
    return f"""
QPushButton {{ background: {t.surface}; color: {t.text}; border: 1px solid {t.ctl};
  border-radius: {RADIUS_CONTROL}px; padding: 8px 16px; min-height: 22px; outline: none; }}
QPushButton:hover {{ background: {t.hover}; border-color: {t.text2}; }}
QPushButton:pressed {{ background: {t.sunk}; }}
QPushButton:focus {{ border: 2px solid {t.accent}; padding: 7px 15px; }}
QPushButton:disabled {{ color: {t.text3}; border-color: {t.border}; background: transparent; }}
QPushButton[dense='true'] {{ padding: 3px 10px; min-height: 24px; }}
QPushButton[dense='true']:focus {{ padding: 2px 9px; }}
QPushButton[role='primary'] {{ background: {t.accent}; color: {t.on_accent}; border: 1px solid {t.accent}; }}
QPushButton[role='primary']:hover {{ background: {t.accent_hover}; border-color: {t.accent_hover}; }}
QPushButton[role='primary']:focus {{ border: 2px solid {t.text}; padding: 7px 15px; }}
QPushButton[role='primary']:disabled {{ background: {t.border}; color: {t.text2}; border-color: {t.border}; }}
QPushButton[role='danger'] {{ color: {t.bad}; border-color: {t.bad}; }}
QPushButton[role='danger']:hover {{ background: {t.bad_bg}; }}
QPushButton[role='danger']:focus {{ border-color: {t.accent}; }}
QPushButton[role='plain'] {{ background: transparent; border-color: transparent; color: {t.text2}; }}
QPushButton[role='plain']:hover {{ background: {t.hover}; }}
QPushButton[role='plain']:focus {{ border: 2px solid {t.accent}; }}
QPushButton[role='segment'] {{ background: transparent; border: 1px solid transparent; color: {t.text2};
    border-radius: {RADIUS_CONTROL - 2}px; padding: 0 8px; min-height: 26px; font-weight: 500; }}
QPushButton[role='segment']:checked {{ background: {t.surface}; border-color: {t.accent}; color: {t.text};
    font-weight: 600; }}
QPushButton[role='segment']:checked:disabled {{ background: {t.sunk}; border-color: {t.ctl}; }}
QPushButton[role='segment']:focus {{ border: 2px solid {t.accent}; padding: 0 7px; min-height: 24px; }}
QWidget[role='segments'] {{ background: {t.sunk}; border: none; border-radius: {RADIUS_CONTROL}px; }}
QPushButton[role='stop'] {{ background: {t.stop}; color: {t.on_stop}; border: 1px solid {t.stop};
  border-radius: {RADIUS_CARD}px; }}
QPushButton[role='stop']:focus {{ border: 3px solid {t.text}; }}
"""


def _field_rules(t: Theme) -> str:
    field = "QLineEdit, QComboBox, QSpinBox, QPlainTextEdit"
    focused, disabled = (", ".join(f"{name}:{state}" for name in field.split(", ")) for state in ("focus", "disabled"))
    refused = ", ".join(f"{name}[state='refused']:focus" for name in ("QLineEdit", "QPlainTextEdit"))
    return f"""
{field} {{ background: {t.surface}; color: {t.text}; border: 1px solid {t.ctl}; border-radius: {RADIUS_CONTROL}px;
  padding: 7px 12px; min-height: 24px; selection-background-color: {t.accent}; selection-color: {t.on_accent}; }}
{focused} {{ border: 2px solid {t.accent}; padding: 6px 11px; }}
QSpinBox {{ max-height: 24px; }}
QLineEdit[dense='true'], QComboBox[dense='true'] {{ padding: 3px 6px; min-height: 22px; }}
QLineEdit[dense='true']:focus, QComboBox[dense='true']:focus {{ padding: 2px 5px; }}
QPlainTextEdit[dense='true'] {{ padding: 6px 8px; min-height: 18px; }}
QPlainTextEdit[dense='true']:focus, QPlainTextEdit[dense='true'][state='refused'] {{ padding: 5px 7px; }}
QLineEdit[state='changed'], QComboBox[state='changed'] {{ border: 2px solid {t.accent}; padding: 2px 5px; }}
QPlainTextEdit[state='refused'] {{ border: 2px solid {t.bad}; }}
QLineEdit[state='refused'] {{ border: 2px solid {t.bad}; padding: 2px 5px; }}
{refused} {{ border: 2px solid {t.accent}; border-left: 5px solid {t.bad}; background: {t.bad_bg}; }}
QLineEdit[state='refused']:focus {{ padding-left: 2px; }}
QPlainTextEdit[dense='true'][state='refused']:focus {{ padding-left: 4px; }}
{disabled}, QLineEdit:read-only {{ background: {t.sunk}; color: {t.text2}; border-color: {t.sunk}; }}
QLineEdit:read-only:focus {{ border-color: {t.accent}; }}
QComboBox {{ combobox-popup: 0; }}
QComboBox::drop-down {{ border: none; width: 28px; }}
QComboBox QAbstractItemView {{ background: {t.surface}; color: {t.text}; border: 1px solid {t.ctl};
  selection-background-color: {t.selected}; selection-color: {t.text}; outline: none; }}
QComboBox QAbstractItemView::item {{ min-height: 30px; padding: 0 8px; }}
QMenu {{ background: {t.surface}; color: {t.text}; border: 1px solid {t.ctl}; padding: 6px; }}
QMenu::item {{ padding: 8px 28px 8px 14px; border-radius: 6px; }}
QMenu::item:selected {{ background: {t.selected}; color: {t.text}; }}
QToolTip {{ background: {t.surface}; color: {t.text}; border: 1px solid {t.ctl}; padding: 4px 8px; }}
"""


def _scroll_bar_rules(t: Theme) -> str:
    return f"""
QTableView, QHeaderView, QHeaderView::section {{ background: transparent; border: none; outline: none; }}
QTableView {{ selection-background-color: transparent; selection-color: {t.text}; }}
QHeaderView::section {{ color: {t.text2}; padding: 0 4px; }}
QHeaderView::section:first {{ padding-left: 12px; }}
QScrollArea, QScrollArea > QWidget > QWidget {{ background: transparent; border: none; }}
QScrollBar:vertical {{ background: transparent; width: 12px; margin: 0; }}
QScrollBar::handle:vertical {{ background: {t.ctl}; border-radius: 4px; min-height: 32px; margin: 2px; }}
QScrollBar:horizontal {{ background: transparent; height: 12px; margin: 0; }}
QScrollBar::handle:horizontal {{ background: {t.ctl}; border-radius: 4px; min-width: 32px; margin: 2px; }}
QScrollBar::add-line, QScrollBar::sub-line, QScrollBar::add-page, QScrollBar::sub-page {{ background: none;
  border: none; width: 0; height: 0; }}
"""
