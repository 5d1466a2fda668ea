"""The question whether the motors of a haptic device are masked."""

from __future__ import annotations

from PySide6.QtWidgets import QWidget

from study_app.gui.widgets.boxes import hbox, vbox
from study_app.gui.widgets.controls import Choice, Number
from study_app.gui.widgets.labels import label
from study_app.session.masking import LOUDEST_DB, MEANS, QUIETEST_DB, USUAL_DB, Masking


class MaskingQuestion(QWidget):
    """A choice, and for noise its level in dB."""

    def __init__(self) -> None:
        super().__init__()
        self.means = Choice()
        self.means.setAccessibleName("Motors masked?")
        for means, words in MEANS.items():
            self.means.addItem(words, means)
        self.noise_db = Number(QUIETEST_DB, LOUDEST_DB, USUAL_DB)
        self.noise_db.setAccessibleName("Level of the noise in dB")
        self.noise_db.setSuffix(" dB")
        self.noise_db.setVisible(False)
        self.means.currentIndexChanged.connect(lambda: self.noise_db.setVisible(self._is_noise))
        row = hbox((self.means, 1), self.noise_db)
        vbox(label("Motors masked?", "label", "text2"), row, margins=0, parent=self)

    @property
    def _is_noise(self) -> bool:
        return bool(self.means.currentData() == "noise")

    def answer(self) -> Masking:
        """Return what was chosen."""
        return Masking(self.means.currentData(), self.noise_db.value() if self._is_noise else None)
