"""Is it healthy: four numbers, each with a verdict and what it is compared with."""

from PySide6.QtWidgets import QGridLayout, QWidget

from study_app.gui.widgets.boxes import STRETCH, add_layout, hbox
from study_app.gui.widgets.cards import Card, Icon
from study_app.gui.widgets.labels import Elided, Ink, figures, label
from study_app.viewmodels.operator import OperatorView
from study_app.viewmodels.servo_health import Tile, Verdict

VERDICTS: dict[Verdict, tuple[str, Ink]] = {
    "ok": ("check", "ok"),
    "late": ("warning", "warn"),
    "open": ("ring", "text3"),
}


class TileCard(Card):
    """One number."""

    def __init__(self) -> None:
        super().__init__(padding=14, gap=4)
        self.title = label("", "label", "text2")
        self.value = figures("", "number")
        self.unit = label("", "label", "text2")
        self.sign = Icon("ring", "text3", 14)
        self.line = Elided("small", "text2")
        self.column.addWidget(self.title)
        row = hbox(self.value, self.unit, STRETCH, spacing=6)
        add_layout(self.column, row)
        below = hbox(self.sign, (self.line, 1), spacing=8)
        add_layout(self.column, below)

    def show_tile(self, tile: Tile) -> None:
        self.title.setText(tile.title)
        self.value.setText(tile.value)
        self.unit.setText(tile.unit)
        self.line.show_text(tile.line)
        self.sign.show_icon(*VERDICTS[tile.verdict])
        words = {"ok": "within limits", "late": "outside limits", "open": "not measured yet"}
        value = f"{tile.value} {tile.unit}".strip()
        self.setAccessibleName(f"{tile.title}: {value}, {words[tile.verdict]}, {tile.line}")


class Tiles(QWidget):
    """The row of four tiles."""

    def __init__(self) -> None:
        super().__init__()
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(0, 0, 0, 0)
        self._grid.setSpacing(10)
        self.cards = [TileCard() for _ in range(4)]
        self.narrow(False)

    def narrow(self, yes: bool) -> None:
        """Stand two by two in a small window."""
        self.across = across = 2 if yes else 4
        for index, card in enumerate(self.cards):
            self._grid.addWidget(card, index // across, index % across)
        for column in range(4):
            self._grid.setColumnStretch(column, int(column < across))

    def show_view(self, view: OperatorView) -> None:
        for card, tile in zip(self.cards, view.tiles, strict=True):
            card.show_tile(tile)
