"""The diagnosis of a device: progress while it is examined, then the report that `doctor` prints."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TypeAlias

from PySide6.QtCore import QSize, Qt, QTimer, Signal
from PySide6.QtGui import QFontDatabase, QGuiApplication
from PySide6.QtWidgets import QApplication, QDialog, QFileDialog, QPlainTextEdit, QProgressBar, QWidget

from study_app.devices.doctor import Report, report_lines
from study_app.devices.doctor_worker import ExaminationClient, start_examination
from study_app.devices.registry import descriptor_of, title_of
from study_app.errors import StoreError
from study_app.gui.kit.devices import as_sentence
from study_app.gui.theme.theme import Theme
from study_app.gui.theme.themed import apply_theme
from study_app.gui.widgets.boxes import STRETCH, hbox, vbox
from study_app.gui.widgets.cards import Icon, Rule
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import label, set_ink
from study_app.store.support import NAME, write_support_archive
from study_app.store.workstation import MachineSettings
from study_app.workers.server import Crashed, Refused

_POLL_MS = 100
_PREPARING = "Preparing… On first use the driver is compiled, which takes about a minute."
_SIZE = QSize(820, 700)


Begin: TypeAlias = Callable[..., ExaminationClient]


class DiagnosisDialog(QDialog):
    """A dialog that examines a device and shows the report; closing it ends the examination.

    ``over(well)`` is emitted when the examination has finished, with whether the device works.

    Parameters
    ----------
    name : name of the device as for ``--device``
    note : a sentence with further information
    begin : starts an examination, given the name and the options
    """

    over = Signal(bool)

    def __init__(
        self,
        parent: QWidget | None,
        theme: Theme,
        name: str,
        *,
        options: Mapping[str, str | Path] | None = None,
        note: str = "",
        begin: Begin = start_examination,
    ) -> None:
        super().__init__(parent)
        self._name, self._options, self._begin = name, options or {}, begin
        title = title_of(name)
        self.setWindowTitle(f"Diagnose {title}")
        self.setModal(False)
        self._examination: ExaminationClient | None = None
        self.leaving: ExaminationClient | None = None
        self._start_pending = False
        self.report: Report | None = None
        self.step = label(_PREPARING, "body", "text2", wraps=True)
        self.note = label(note, "label", "warn", wraps=True)
        self.note.setVisible(bool(note))
        self.saved = label("", "label", "text2", wraps=True, weight=400)
        self.text = QPlainTextEdit(readOnly=True)
        self.text.setFont(QFontDatabase.systemFont(QFontDatabase.SystemFont.FixedFont))
        self.text.setAccessibleName("Report")
        self.bar = QProgressBar(textVisible=False)
        self.bar.setRange(0, 0)
        self.bar.setFixedHeight(8)
        self.sign = Icon("pulse", "accent", 26)
        self.again = ActionButton("repeat", "Run again")
        self.copy = ActionButton("copy", "Copy report")
        self.support = ActionButton("save", "Save for support…")
        self.close_button = ActionButton("", "Cancel")
        self._lay_out(title)
        self._connect()
        self.setMinimumSize(680, 420)
        available = self.screen().availableSize()
        self.resize(_SIZE.boundedTo(QSize(available.width() - 40, available.height() - 60)))
        apply_theme(self, theme)
        self._timer = QTimer(self, interval=_POLL_MS)
        self._timer.timeout.connect(self._read_answers)
        self.examine()

    def _lay_out(self, title: str) -> None:
        text = vbox(label(f"Diagnose {title}", "title_dense"), self.step, spacing=4)
        head = hbox((self.sign, 0, Qt.AlignmentFlag.AlignTop), (text, 1), spacing=14)
        foot = hbox(self.close_button, STRETCH, self.support, self.copy, self.again, spacing=12)
        vbox(
            head,
            self.bar,
            self.note,
            self.saved,
            (self.text, 1),
            Rule(),
            foot,
            spacing=12,
            margins=(28, 24, 28, 20),
            parent=self,
        )

    def _connect(self) -> None:
        self.close_button.clicked.connect(self.reject)
        self.again.clicked.connect(self.examine)
        self.copy.clicked.connect(self._copy_report)
        self.support.clicked.connect(self._ask_for_path)
        for button in (self.again, self.copy, self.support):
            button.setAutoDefault(False)
        self.close_button.setDefault(True)

    def examine(self) -> None:
        self._end_process()
        self.report = None
        self._show_step(_PREPARING, "text2", "pulse", "accent")
        self.saved.hide()
        self.text.clear()
        self.bar.show()
        self.again.setEnabled(False)
        self.copy.setEnabled(False)
        self.copy.show_action("copy", "Copy report")
        self.support.setEnabled(False)
        self.close_button.show_action("", "Cancel")
        self._start_pending = True
        self._timer.start()
        self._read_answers()

    def _read_answers(self) -> None:
        """Start the examination as soon as the previous one has released the device, then read its answers."""
        if self._start_pending and (self.leaving is None or self.leaving.ended):
            self._start_pending = False
            self._examination = self._begin(self._name, options=self._options)
        for _, answer in [] if self._examination is None else self._examination.answers():
            if isinstance(answer, str):
                self._show_step(answer, "text", "pulse", "accent")
                self.text.appendPlainText(answer)
            else:
                self._show_conclusion(answer)

    def _show_conclusion(self, conclusion: Report | Refused | Crashed) -> None:
        self._timer.stop()
        self.bar.hide()
        self.again.setEnabled(True)
        self.support.setEnabled(True)
        self.close_button.show_action("", "Close")
        self._end_process()
        if not isinstance(conclusion, Report):
            self._show_step(as_sentence(conclusion.sentence), "bad", "warning", "bad")
            self.over.emit(False)
            return
        self.report = conclusion
        self.copy.setEnabled(True)
        well = conclusion.well
        sentence = conclusion.conclusion if conclusion.failure is None else as_sentence(conclusion.failure)
        self._show_step(sentence, "text2" if well else "bad", "check" if well else "warning", "ok" if well else "bad")
        self.text.setPlainText(self._report_text())
        self.over.emit(well)

    def _show_step(self, sentence: str, ink: str, sign: str, sign_ink: str) -> None:
        self.step.setText(sentence)
        set_ink(self.step, ink)  # type: ignore[arg-type]
        self.sign.show_icon(sign, sign_ink)  # type: ignore[arg-type]

    def _copy_report(self) -> None:
        QGuiApplication.clipboard().setText(self._report_text())
        self.copy.show_action("check", "Copied")

    def _report_text(self) -> str:
        return "" if self.report is None else "\n".join(report_lines(self.report)).strip() + "\n"

    def _ask_for_path(self) -> None:
        dialog = QFileDialog(self, "Save a zip file for support", NAME, "Zip files (*.zip)")
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        dialog.setDefaultSuffix("zip")
        dialog.fileSelected.connect(lambda path: self.save_support(Path(path)))
        dialog.finished.connect(dialog.deleteLater)
        dialog.open()

    def save_support(self, path: Path) -> None:
        """Write a zip file with versions, settings, log, last error and report; show its path, or the error."""
        try:
            write_support_archive(path, self._report_text())
        except StoreError as error:
            self.saved.setText(as_sentence(str(error)))
        else:
            self.saved.setText(
                f"Saved as {path}. The file does not contain participant IDs, answers or liquid parameters."
            )
        self.saved.show()

    def _end_process(self) -> None:
        """Ask the process to close the device and end, without waiting for it."""
        if self._examination is not None:
            self._examination.close()
            self.leaving, self._examination = self._examination, None

    def done(self, result: int) -> None:
        """End the examination, however the dialog is closed."""
        self._timer.stop()
        self._start_pending = False
        self._end_process()
        super().done(result)


_HELD = (
    "This session is using the device, so some checks cannot run. For a full diagnosis, end the session first; you "
    "can resume it later."
)


def open_diagnosis(
    parent: QWidget, theme: Theme, name: str, settings: MachineSettings, *, held: bool = False
) -> DiagnosisDialog:
    """Open the diagnosis of a device; ``held`` means that a session uses the device."""
    options = descriptor_of(name).window_values(settings.device_options)
    dialog = DiagnosisDialog(parent, theme, name, options=options, note=_HELD if held else "")
    dialog.finished.connect(dialog.deleteLater)
    if settings.sound:
        dialog.over.connect(lambda _well: QApplication.beep())
    return dialog
