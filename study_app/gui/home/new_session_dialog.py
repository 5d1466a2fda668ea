"""The questions before a session. Nothing is created until Begin; Cancel leaves everything as it was."""

from functools import partial
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtGui import QIntValidator
from PySide6.QtWidgets import QDialog, QFileDialog, QGridLayout, QVBoxLayout, QWidget

from study_app.devices.registry import list_devices
from study_app.errors import StudyError
from study_app.gui.display.screens import screens_shown
from study_app.gui.home.device_option_fields import DeviceOptionFields
from study_app.gui.home.form_fields import add_field, field_with_button, text_field
from study_app.gui.home.study_folder_state import StudyFolderState, read_study_folder_state
from study_app.gui.theme.theme import LIGHT, Theme, font
from study_app.gui.theme.themed import apply_theme
from study_app.gui.widgets.background import Background
from study_app.gui.widgets.boxes import STRETCH, add_layout, hbox, vbox
from study_app.gui.widgets.cards import Icon, Rule, scrolled
from study_app.gui.widgets.controls import ActionButton, Check, Choice, Number
from study_app.gui.widgets.labels import label, set_ink
from study_app.protocol.groups import refuse_beyond_last
from study_app.protocol.wording.languages import language_name
from study_app.session.start import NewSession, check_row, draw_seed, study_results
from study_app.store.sessions.begin import MAX_SESSION, check_participant
from study_app.store.workstation import DEFAULTS, MachineSettings
from study_app.viewmodels.devices.list_view import device_label, device_or_default
from study_app.viewmodels.home import StudyFacts
from study_app.workspace import workspace

FRAME = 60  # of a window, at most
ROW_HINT = "the session takes that participant's row of the square; empty: its own row"


class NewSessionDialog(QDialog):
    """Asks who, with which seed, in which language, on which device and screen.

    Parameters
    ----------
    facts
        The protocol to run.
    results
        Folder that holds the studies' folders; the study's own is suggested.
    machine
        What is set for this machine: device, its options and screen to begin with.
    """

    def __init__(
        self,
        facts: StudyFacts,
        results: Path,
        *,
        machine: MachineSettings = DEFAULTS,
        theme: Theme = LIGHT,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.facts = facts
        self._machine = machine
        self._state: StudyFolderState | None = None
        self._reader = Background(self)
        self._reader.done.connect(self._take_state)
        self.setWindowTitle("New session")
        self.setModal(True)
        self.setMinimumWidth(736)
        self._all_results = results
        self._suggested = str(study_results(results, facts.protocol.study.name, device_or_default(machine.device)))
        self.results = text_field("Results folder of this study")
        self.results.setText(self._suggested)
        self.where = label("", "small", "text3")
        self.participant = text_field("Participant")
        self.session = Number(1, MAX_SESSION, 1)
        self.seed = text_field("Seed")
        self.operator = text_field("Operator")
        self.row_of = text_field("Replaces participant")
        self.language = Choice()
        self.device = Choice()
        self.device_options = DeviceOptionFields(machine.device_options)
        self.screen_choice = Choice()
        self.windowed = Check("In a window instead of full screen")
        self.pilot = Check("Pilot: marked by a frame, stored separately")
        self.verdict_icon = Icon("check", "ok", 18)
        self.verdict = label("", "label", "ok", wraps=True)
        self._free = 1, ""
        self._windowed_without_pilot = False
        self.ways = [ActionButton("", "", height=34) for _ in range(2)]
        self.begin = ActionButton("play", "Begin", role="primary", height=46)
        self.cancel = ActionButton("", "Cancel", height=46)
        self._fill()
        self._lay_out()
        apply_theme(self, theme)
        self._check()
        self.participant.setFocus()
        self.participant.selectAll()

    def _fill(self) -> None:
        study = self.facts.protocol.study
        self.participant.setText(self._state_now().used.suggested())
        self.session.setAccessibleName("Session")
        self.seed.setText(str(draw_seed()))
        self.seed.setValidator(QIntValidator(0, 2_147_483_647, self))
        self.operator.setPlaceholderText("Initials, such as AK")
        self.operator.setMaxLength(40)
        self.operator.setText(self._machine.operator)
        for code in study.languages:
            self.language.addItem(language_name(code), code)
        preferred = device_or_default(self._machine.device)
        for name in dict.fromkeys((*list_devices(), preferred)):
            self.device.addItem(device_label(name), name)
        self.device.setCurrentIndex(self.device.findData(preferred))
        self.device_options.show_device(preferred)
        screens = screens_shown()
        for screen in screens:
            self.screen_choice.addItem(f"Screen {screen.number}: {screen.words}", screen.number)
        self.screen_choice.setCurrentIndex(self._machine.screen_among([screen.name for screen in screens]) - 1)
        self.windowed.setChecked(len(screens) == 1)
        for name, widget in (("Language", self.language), ("Device", self.device), ("Screen", self.screen_choice)):
            widget.setAccessibleName(name)
        fields: tuple[QWidget, ...] = (
            self.session,
            self.language,
            self.device,
            self.screen_choice,
            self.windowed,
            self.pilot,
        )
        for field in fields:
            field.setFont(font("body"))
        self.device.currentIndexChanged.connect(self._choose_device)
        self.device_options.changed.connect(self._check)
        self.pilot.toggled.connect(self._choose_pilot)
        self.participant.textChanged.connect(self._check)
        self.session.valueChanged.connect(self._check)
        self.seed.textChanged.connect(self._check)
        self.row_of.textChanged.connect(self._check)
        self.results.textChanged.connect(self._check)
        self.ways[0].clicked.connect(lambda: self.session.setValue(self._free[0]))
        self.ways[1].clicked.connect(lambda: self.participant.setText(self._free[1]))
        self.begin.clicked.connect(self.accept)
        self.cancel.clicked.connect(self.reject)
        self.begin.setDefault(True)
        self.cancel.setAutoDefault(False)

    def _lay_out(self) -> None:
        self._inside = QWidget()
        grid = QGridLayout(self._inside)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setHorizontalSpacing(16)
        grid.setVerticalSpacing(6)
        for place in (0, 1):
            grid.setColumnStretch(place, 1)
        another = ActionButton("repeat", "Draw another", height=40)
        another.setAutoDefault(False)
        another.clicked.connect(lambda: self.seed.setText(str(draw_seed())))
        change = ActionButton("", "Change …", height=40)
        change.setAutoDefault(False)
        change.clicked.connect(self._choose_folder)
        add_field(grid, 0, 0, "Participant", self.participant, hint="letters and digits, no name")
        add_field(grid, 0, 1, "Session", self.session)
        add_layout(grid, self._judge(), 2, 0, 1, 2)
        add_field(grid, 4, 0, "Seed", field_with_button(self.seed, another), hint="determines every order; recorded")
        add_field(grid, 4, 1, "Operator", self.operator)
        add_field(grid, 6, 0, "Language of the participant's pages", self.language)
        add_field(grid, 6, 1, "Device", self.device)
        add_field(grid, 8, 0, "Participant's screen", self.screen_choice)
        add_layout(grid, vbox(self.windowed, self.pilot, spacing=2), 8, 1, 2, 1, Qt.AlignmentFlag.AlignBottom)
        folder = field_with_button(self.results, change)
        add_field(grid, 10, 0, "Results folder of this study", folder, hint=self.where, across=2)
        if self.facts.protocol.assigns_rows:
            add_field(grid, 12, 0, "Replaces participant", self.row_of, hint=ROW_HINT, across=2)
        grid.addWidget(self.device_options, 14, 0, 1, 2)
        self._area = scrolled(self._inside)
        head = label("New session", "title_dense")
        about = f"{self.facts.title}  ·  {self.facts.extent}  ·  {self.facts.duration}"
        told = label(about, "body", "text2", wraps=True)
        note = label("Nothing is created until you begin.", "label", "text2")
        foot = hbox(self.cancel, note, STRETCH, self.begin, spacing=16)
        vbox(head, told, 6, (self._area, 1), 10, Rule(), 4, foot, spacing=10, margins=(32, 28, 32, 24), parent=self)

    def _fit(self) -> None:
        """Be as high as the questions are, but no higher than the screen: then they scroll, and the foot stays."""
        inside, whole = self._inside.layout(), self.layout()
        assert inside is not None and whole is not None  # noqa: S101, PT018 - laid out above
        wide = self.minimumWidth() - whole.contentsMargins().left() - whole.contentsMargins().right()
        inside.activate()
        needed = inside.totalHeightForWidth(wide)
        self._area.setMinimumHeight(0)
        around = whole.totalMinimumSize().height() - self._area.minimumSizeHint().height()
        self._area.setMinimumHeight(min(needed, self.screen().availableSize().height() - FRAME - around))
        self.adjustSize()

    def _judge(self) -> QVBoxLayout:
        """Return the place of the verdict, and below it the ways on where an id is used."""
        verdict = hbox((self.verdict_icon, 0, Qt.AlignmentFlag.AlignTop), (self.verdict, 1), spacing=8)
        self._ways_row = QWidget()
        hbox(*self.ways, STRETCH, margins=(26, 0, 0, 0), parent=self._ways_row)
        for way in self.ways:
            way.setAutoDefault(False)
        return vbox(verdict, self._ways_row, spacing=6)

    def _choose_folder(self) -> None:
        chosen = QFileDialog.getExistingDirectory(self, "Results folder of this study", self.results.text())
        if chosen:
            self.results.setText(chosen)

    def _choose_device(self) -> None:
        """Ask for the options of the device, and for another folder where it is simulated."""
        self.device_options.show_device(self.device.currentData())
        self._suggest_folder()
        self._check()

    def _suggest_folder(self) -> None:
        """Keep pilots and a simulated hand's sessions apart, unless the operator chose a folder."""
        if self.results.text() == self._suggested:
            study, pilot = self.facts.protocol.study.name, self.pilot.isChecked()
            folder = study_results(self._all_results, study, self.device.currentData(), pilot=pilot)
            self._suggested = str(folder)
            self.results.setText(self._suggested)

    def _choose_pilot(self, pilot: bool) -> None:
        """Put a pilot in a framed window and suggest its folder; restore both choices if it is no pilot."""
        if pilot:
            self._windowed_without_pilot = self.windowed.isChecked()
        self.windowed.setChecked(pilot or self._windowed_without_pilot)
        self.windowed.setEnabled(not pilot)
        self._suggest_folder()
        self._check()

    def _check(self) -> None:
        """Judge what stands there, and look whether the folder has changed since."""
        self._show_verdict()
        self._look()

    def _show_verdict(self) -> None:
        fault = self._fault()
        inside = Path(self.results.text()).resolve().is_relative_to(workspace().folder.resolve())
        self.where.setText("in the workspace" if inside else "outside the workspace: Home will not list its sessions")
        self._offer_ways()
        if fault:
            self._say(fault, good=False)
        else:
            self._say(f"{self.participant.text().strip()} is free, session {self.session.value()}", good=True)
        self._fit()

    def _look(self) -> None:
        """Read the study's folder again, outside the window's thread: another program may use it, too."""
        if text := self.results.text().strip():
            self._reader.run(partial(read_study_folder_state, Path(text), self.facts.protocol))

    def _take_state(self, state: StudyFolderState) -> None:
        if state.path == Path(self.results.text().strip()) and state != self._state:
            self._state = state
            self._show_verdict()

    def _state_now(self) -> StudyFolderState:
        """Return the study's folder as it was last read; one that was just chosen is read at once."""
        path = Path(self.results.text().strip() or ".")
        if self._state is None or self._state.path != path:
            self._state = read_study_folder_state(path, self.facts.protocol)
        return self._state

    def _fault(self) -> str:
        """Return why this cannot begin; nothing is touched to find out."""
        if not self.results.text().strip():
            return "choose a results folder"
        participant, state = self.participant.text().strip(), self._state_now()
        try:
            check_participant(participant, pilot=self.pilot.isChecked())
            if state.fault:
                return state.fault
            state.used.check_unused(participant, self.session.value())
            check_row(self._row_of(), self.facts.protocol)
            refuse_beyond_last(self.facts.protocol, self.session.value())
        except StudyError as error:
            return str(error)
        if missing := self.device_options.fault():
            return missing
        return "" if self.seed.hasAcceptableInput() else "the seed is a whole number from 0 to 2147483647"

    def _row_of(self) -> str | None:
        return self.row_of.text().strip() or None

    def _offer_ways(self) -> None:
        """Where the id is used, offer the ways to go on that need no thought; going on with its session is for home."""
        participant, used = self.participant.text().strip(), self._state_now().used
        held = used.numbers(participant)
        self._ways_row.setVisible(self.session.value() in held)
        if self.session.value() not in held:
            return
        self._free = min(max(held) + 1, MAX_SESSION), used.suggested()
        another, new = self.ways
        another.show_action("", f"Session {self._free[0]} of {participant}")
        new.show_action("", f"New participant {self._free[1]}")

    def _say(self, words: str, *, good: bool) -> None:
        by_id = words.startswith(f"{self.participant.text().strip()} ")  # an id stands as it was typed
        self.verdict.setText(words if by_id else words[:1].upper() + words[1:])
        set_ink(self.verdict, "ok" if good else "bad")
        self.verdict_icon.show_icon(*(("check", "ok") if good else ("warning", "bad")))
        self.begin.setEnabled(good)

    def chosen(self) -> NewSession:
        """Return what was chosen."""
        return NewSession(
            source=self.facts.source,
            participant=self.participant.text().strip(),
            session=self.session.value(),
            seed=int(self.seed.text()),
            operator=self.operator.text().strip(),
            language=self.language.currentData(),
            device=self.device.currentData(),
            windowed=self.windowed.isChecked(),
            screen=self.screen_choice.currentData(),
            results=Path(self.results.text().strip()),
            pilot=self.pilot.isChecked(),
            device_options=self.device_options.values(),
            row_of=self._row_of(),
        )
