"""The dialogs of the home page: a new session, a rehearsal, the workspace; nothing is created before acceptance."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any

from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import QDialog, QLineEdit, QWidget

from study_app.devices.registry import descriptor_of, list_devices
from study_app.errors import StoreError, StudyError
from study_app.gui.display.screens import screens_shown
from study_app.gui.home.study_facts import StudyFacts
from study_app.gui.kit.devices import device_label, device_or_default, window_options
from study_app.gui.kit.dialogs import Question, Work
from study_app.gui.kit.fields import Editor, Field, choice_field, seed_field, typed_file
from study_app.gui.startup_window import FIRST_TIME
from study_app.gui.theme.theme import LIGHT, Theme
from study_app.gui.theme.themed import apply_theme
from study_app.gui.widgets.background import Background
from study_app.gui.widgets.boxes import STRETCH, grid, hbox, vbox
from study_app.gui.widgets.cards import Icon, Rule, scrolled
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import Ink, label, set_ink
from study_app.number_text import counted
from study_app.protocol.load import read_document
from study_app.protocol.model import Protocol
from study_app.protocol.source import source_bytes
from study_app.protocol.warnings import check_translated
from study_app.protocol.wording import LANGUAGES, language_name
from study_app.session.simulated.rehearsal_worker import TASK, RehearsalClient, RehearsalOrder
from study_app.session.start import MAX_SEED, NewSession, check_row, draw_seed, study_results
from study_app.store.blinded import Claim, check_choice, check_conditions, claims
from study_app.store.files import StudyFolder, rehearsal_folder
from study_app.store.sessions import MAX_SESSION, UsedIds, check_participant, used_ids
from study_app.store.tables import check_study
from study_app.store.workstation import DEFAULTS, MachineSettings
from study_app.workers.client import WorkerClient
from study_app.workspace import workspace

_MAX_PARTICIPANTS = 200
_REHEARSED = 5
"""The number of simulated participants that is suggested if the study does not plan a number."""
_POLL_MS = 40


class RehearsalDialog(Work):
    """A dialog that asks for the number of simulated participants, then shows progress and a link to the results.

    Cancel keeps completed sessions. The dialog is accepted when the results should be shown.

    Parameters
    ----------
    facts : the protocol
    results : folder that contains the studies' folders; the rehearsal gets its own
    """

    def __init__(
        self, facts: StudyFacts, results: Path, *, theme: Theme = LIGHT, parent: QWidget | None = None
    ) -> None:
        self.folder = rehearsal_folder(results, facts.protocol.study.name)
        groups = LANGUAGES["en"].joined(tuple(facts.protocol.groups))
        group_note = (
            f" Participants are divided among the groups {groups} in the planned ratio."
            if facts.protocol.asks_group
            else ""
        )
        super().__init__(
            parent,
            theme,
            f"Rehearse {facts.title}",
            "Simulated participants complete whole sessions faster than real time. The sessions are marked as "
            f"simulated and stored separately in {self.folder}.{group_note}",
            ActionButton("fast_forward", "Rehearse", role="primary"),
            fields=(
                Field("participants", "Simulated participants", "count", limits=(1, _MAX_PARTICIPANTS)),
                Field("seed", "Seed", "count", limits=(0, MAX_SEED)),
            ),
            width=520,
        )
        self._facts = facts
        plan = facts.protocol.analysis
        planned = plan.participants if plan is not None else None
        for name, value in (("participants", min(planned or _REHEARSED, _MAX_PARTICIPANTS)), ("seed", 1)):
            self.editors[name].show_value(value)
        self.worker: RehearsalClient | None = None
        self._done = 0
        self.begun.connect(self._start_rehearsal)
        self.stop_asked.connect(self._stop_rehearsal)
        self.opened.connect(lambda: self.done(QDialog.DialogCode.Accepted.value))
        self._listening = QTimer(self, interval=_POLL_MS)
        self._listening.timeout.connect(self._read_answers)

    def _start_rehearsal(self) -> None:
        count = self.value("participants")
        self._done = 0
        self.show_progress(f"0 of {count}: rehearsing…", 0.0)
        try:
            self.worker = WorkerClient(TASK, name="rehearsal")
        except OSError as error:
            self.show_refused(str(error))
            return
        self.worker.order(RehearsalOrder(self._facts.source, count, self.value("seed"), self.folder))
        self._listening.start()

    def _stop_rehearsal(self) -> None:
        if self.worker is not None:
            self.worker.close()

    def _read_answers(self) -> None:
        """Read new answers; after a request to stop, close the dialog once the process has ended."""
        assert self.worker is not None  # noqa: S101 - answers are read only after the start
        if not self.back.isEnabled():
            if self.worker.ended:
                self._listening.stop()
                self.close_stopped()
            return
        count = self.value("participants")
        for _, answer in self.worker.answers():
            if isinstance(answer, float):
                self.show_progress(FIRST_TIME, answer)
            elif isinstance(answer, str):
                self._done += 1
                self.show_progress(f"{self._done} of {count}: {answer}", self._done / count)
            else:
                self._listening.stop()
                self.worker.close()
                if isinstance(answer, Path):
                    self.show_done(
                        f"Done: {counted(count, 'simulated participant')}, stored in {self.folder}.", "Open results"
                    )
                else:
                    self.show_refused(answer.sentence)

    def end(self) -> None:
        """Stop the rehearsal and wait for its process, because the windows are closed."""
        self._listening.stop()
        self.working = False
        if self.worker is not None:
            self.worker.close()
            self.worker.wait_until_ended()


_FRAME = 60  # maximum height of a window's frame [px]
INSIDE, OUTSIDE = "in the workspace", "outside the workspace: Home will not list its sessions"
_HOLDS = "The workspace will contain the folders protocols and results."
_ROW_HINT = "the session uses that participant's order; leave empty if no one is being replaced"
_PLACE_HINT = (
    "the session uses that participant's order and position in the group; leave empty if no one is being replaced"
)
_GROUP_HINT = "recorded as a property of the participant"


@dataclass(frozen=True, slots=True)
class _StudyFolderState:
    """A snapshot of a study's folder: the used IDs, and the reason why it cannot hold new sessions, or "".

    ``held`` are the recorded groups of its participants.
    """

    path: Path
    used: UsedIds
    held: tuple[Claim, ...]
    fault: str

    def group_of(self, participant: str) -> str | None:
        """Return the recorded group of a participant, or None."""
        return next((claim.group for claim in self.held if claim.participant == participant), None)


def _read_study_folder_state(path: Path, protocol: Protocol) -> _StudyFolderState:
    """Return a snapshot of a study's folder."""
    folder, fault = StudyFolder(path), ""
    used = UsedIds(path, frozenset(), ())
    try:
        check_study(folder, protocol.study.name)
        used = used_ids(folder)
        check_conditions(path, protocol)
    except StoreError as error:
        fault = str(error)
    return _StudyFolderState(path, used, tuple(claims(folder)), fault)


class _ChoiceMissing(ValueError):
    """A choice that the operator still has to make."""


class NewSessionDialog(QDialog):
    """A dialog that asks for participant, seed, language, device and screen of a new session.

    Parameters
    ----------
    facts : the protocol to run
    results : folder that contains the studies' folders; the study's own is suggested
    machine : the settings of this machine: initial device, its options and screen
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
        self.facts, self._all_results = facts, results
        self._state: _StudyFolderState | None = None
        self._reader = Background(self)
        self._reader.done.connect(self._apply_state)
        self.setWindowTitle("New session")
        self.setModal(True)
        self.setMinimumWidth(736)
        self.verdict_icon, self.verdict = Icon("check", "ok", 18), label("", "label", "ok", wraps=True)
        self._free_ids = 1, ""
        self._windowed_without_pilot = False
        self.suggestions = another, new = ActionButton("", "", height=34), ActionButton("", "", height=34)
        self.begin = ActionButton("play", "Begin", role="primary", height=46)
        self.cancel = ActionButton("", "Cancel", height=46)
        self._make_editors(machine)
        self._lay_out()
        apply_theme(self, theme)
        for name, editor in self.editors.items():
            editor.edited.connect(
                {"device": self._choose_device, "pilot": self._choose_pilot}.get(name, self._check_answers)
            )
        another.clicked.connect(lambda: self.editors["session"].show_value(self._free_ids[0]))
        new.clicked.connect(lambda: self.editors["participant"].show_value(self._free_ids[1]))
        self.begin.clicked.connect(self.accept)
        self.cancel.clicked.connect(self.reject)
        self._check_answers()
        participant = self.editors["participant"].control
        assert isinstance(participant, QLineEdit)  # noqa: S101 - an id is typed
        participant.setFocus()
        participant.selectAll()

    def _make_editors(self, machine: MachineSettings) -> None:
        study, screens, device = self.facts.protocol.study, screens_shown(), device_or_default(machine.device)
        self._suggested = str(study_results(self._all_results, study.name, device))
        devices = dict.fromkeys((*list_devices(), device))
        languages = {code: language_name(code) for code in study.languages}
        screen_titles = {screen.number: f"Screen {screen.number}: {screen.words}" for screen in screens}
        fields = (
            Field("participant", "Participant", aside="letters and digits, not a name"),
            Field("session", "Session", "count", limits=(1, MAX_SESSION)),
            seed_field("determines all random orders and is recorded"),
            Field("operator", "Operator", longest=40, placeholder="Initials, such as AK"),
            choice_field("language", "Language of the participant's pages", languages),
            choice_field("device", "Device", {name: device_label(name) for name in devices}),
            choice_field("screen", "Participant's screen", screen_titles),
            Field("windowed", "In a window instead of full screen", "check"),
            Field("pilot", "Pilot: marked with a frame and stored separately", "check"),
            Field("results", "Results folder for this study", "folder"),
            choice_field("group", "Group", {name: name for name in self.facts.protocol.groups}, aside=_GROUP_HINT),
            Field(
                "row_of", "Replaces participant", aside=_PLACE_HINT if self.facts.protocol.groups else _ROW_HINT,
                parse=lambda text: text or None,
            ),
            *(
                Field(
                    option.name, option.title, "file" if option.file_filter else "line", aside=option.hint,
                    placeholder=option.placeholder, file_filter=option.file_filter,
                    parse=partial(typed_file, option.name) if option.file_filter else str,
                )
                for option in window_options()
            ),
        )  # fmt: skip
        redraw = ActionButton("repeat", "Draw another", height=40)
        redraw.setAutoDefault(False)
        redraw.clicked.connect(lambda: self.editors["seed"].show_value(draw_seed()))
        self.editors: dict[str, Editor] = {
            field.name: Editor(field, redraw if field.name == "seed" else None, judges=True) for field in fields
        }
        values = {
            "seed": draw_seed(),
            "operator": machine.operator,
            "device": device,
            "windowed": len(screens) == 1,
            "screen": machine.screen_among([screen.name for screen in screens]),
            "results": self._suggested,
            **machine.device_options,
        }
        for name, value in values.items():
            self.editors[name].show_value(value)
        self.editors["participant"].show_value(self._current_state().used.suggested())
        self.editors["group"].show_value(None)  # so that the operator must choose
        self.editors["group"].setVisible(self.facts.protocol.asks_group)
        self.editors["row_of"].setVisible(self.facts.protocol.assigns_rows or bool(self.facts.protocol.groups))

    def _lay_out(self) -> None:
        self._suggestions_row, self._inside = QWidget(), QWidget()
        hbox(*self.suggestions, STRETCH, margins=(26, 0, 0, 0), parent=self._suggestions_row)
        for button in (*self.suggestions, self.cancel):
            button.setAutoDefault(False)
        self.begin.setDefault(True)
        verdict = hbox((self.verdict_icon, 0, Qt.AlignmentFlag.AlignTop), (self.verdict, 1), spacing=8)
        verdict_box, checks, e = QWidget(), QWidget(), self.editors
        vbox(verdict, self._suggestions_row, spacing=6, margins=0, parent=verdict_box)
        vbox(e["windowed"], e["pilot"], spacing=2, margins=(0, 4, 0, 0), parent=checks)
        pairs = (
            (e["participant"], e["session"]),
            (verdict_box,),
            (e["group"],),
            (e["seed"], e["operator"]),
            (e["language"], e["device"]),
            (e["screen"], checks),
            (e["results"],),
            (e["row_of"],),
            *((e[option.name],) for option in window_options()),
        )
        cells = grid(16, 12, margins=0, parent=self._inside)
        cells.setRowStretch(len(pairs), 1)
        for row, pair in enumerate(pairs):
            for column, part in enumerate(pair):
                cells.setColumnStretch(column, 1)
                cells.addWidget(part, row, column, 1, 3 - len(pair))
        self._area = scrolled(self._inside)
        about = f"{self.facts.title}  ·  {self.facts.extent}  ·  {self.facts.duration}"
        head, explanation = label("New session", "title_dense"), label(about, "body", "text2", wraps=True)
        note = label("Nothing is created until you begin.", "label", "text2")
        foot = hbox(self.cancel, note, STRETCH, self.begin, spacing=16)
        vbox(
            head,
            explanation,
            6,
            (self._area, 1),
            10,
            Rule(),
            4,
            foot,
            spacing=10,
            margins=(32, 28, 32, 24),
            parent=self,
        )

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        QTimer.singleShot(0, self, self._fit_height)  # after the style sheet is applied

    def _fit_height(self) -> None:
        """Make the dialog as high as its fields or, if the screen is lower, as the screen; the fields then scroll.

        The dialog is wide enough for the fields and their scroll bar.
        """
        questions, outer = self._inside.layout(), self.layout()
        assert questions is not None and outer is not None  # noqa: S101, PT018 - laid out above
        questions.activate()
        margins_px = outer.contentsMargins().left() + outer.contentsMargins().right()
        least_px = questions.totalMinimumSize().width() + self._area.verticalScrollBar().sizeHint().width() + margins_px
        self.setMinimumWidth(max(self.minimumWidth(), least_px))
        width_px = self.minimumWidth() - margins_px
        fields_px = questions.totalHeightForWidth(width_px)
        self._area.setMinimumHeight(0)
        frame_px = outer.totalMinimumSize().height() - self._area.minimumSizeHint().height()
        self._area.setMinimumHeight(min(fields_px, self.screen().availableSize().height() - _FRAME - frame_px))
        self.adjustSize()

    def _choose_device(self) -> None:
        self._suggest_folder()
        self._check_answers()

    def _suggest_folder(self) -> None:
        """Suggest the folder for the chosen device or for pilots, unless the operator has chosen a folder."""
        if self._value("results") == self._suggested:
            study, device, pilot = self.facts.protocol.study.name, self._value("device"), self._value("pilot")
            self._suggested = str(study_results(self._all_results, study, device, pilot=pilot))
            self.editors["results"].show_value(self._suggested)

    def _choose_pilot(self) -> None:
        """Choose a window and the folder for pilots, or restore both choices."""
        pilot, windowed = self._value("pilot"), self.editors["windowed"]
        if pilot:
            self._windowed_without_pilot = windowed.value
        windowed.show_value(pilot or self._windowed_without_pilot)
        windowed.setEnabled(not pilot)
        self._suggest_folder()
        self._check_answers()

    def _value(self, name: str) -> Any:
        return self.editors[name].value

    def _check_answers(self) -> None:
        """Show whether the session can begin, and read the folder again in the background."""
        self._show_verdict()
        if text := self._value("results"):
            self._reader.run(partial(_read_study_folder_state, Path(text), self.facts.protocol))

    def _apply_state(self, state: _StudyFolderState) -> None:
        if state.path == Path(self._value("results")) and state != self._state:
            self._state = state
            self._show_verdict()

    def _current_state(self) -> _StudyFolderState:
        """Return the last snapshot of the study's folder; read a newly chosen folder at once."""
        path = Path(self._value("results") or ".")
        if self._state is None or self._state.path != path:
            self._state = _read_study_folder_state(path, self.facts.protocol)
        return self._state

    def _show_verdict(self) -> None:
        in_workspace = Path(self._value("results")).resolve().is_relative_to(workspace().folder.resolve())
        self.editors["results"].aside.setText(INSIDE if in_workspace else OUTSIDE)
        for option in window_options():
            self.editors[option.name].setVisible(option.name in self._asked_options())
        participant, session, used = self._value("participant"), self._value("session"), self._current_state().used
        self._show_recorded_group(self._current_state().group_of(participant))
        numbers = used.numbers(participant)
        self._suggestions_row.setVisible(session in numbers)
        if session in numbers:  # offer free IDs; interrupted sessions are resumed on the home page
            self._free_ids = min(max(numbers) + 1, MAX_SESSION), used.suggested()
            self.suggestions[0].show_action("", f"Session {self._free_ids[0]} of {participant}")
            self.suggestions[1].show_action("", f"New participant {self._free_ids[1]}")
        fault, sign = "", "check"
        ink: Ink = "ok"
        try:
            self._check_session()
        except _ChoiceMissing as missing:  # not an error
            fault, sign, ink = str(missing), "info", "text2"
        except (StudyError, ValueError) as error:
            fault, sign, ink = str(error), "warning", "bad"
        sentence = fault or f"The ID {participant} can be used for session {session}"
        begins_with_id = sentence.startswith(f"{participant} ")  # IDs are not capitalised
        self.verdict.setText(sentence if begins_with_id else sentence[:1].upper() + sentence[1:])
        set_ink(self.verdict, ink)
        self.verdict_icon.show_icon(sign, ink)
        self.begin.setEnabled(not fault)
        self._fit_height()

    def _show_recorded_group(self, recorded: str | None) -> None:
        """Show the recorded group of a participant, which cannot be changed, or let the operator choose one."""
        group = self.editors["group"]
        if recorded is not None or not group.isEnabled():
            group.show_value(recorded)
        group.setEnabled(recorded is None)

    def _check_session(self) -> None:
        """Raise ValueError or StudyError if the session cannot begin."""
        if not self._value("results"):
            raise ValueError("choose a results folder")
        participant, session, state = self._value("participant"), self._value("session"), self._current_state()
        if not self._value("pilot"):
            check_translated(self._document)
        check_participant(participant, pilot=self._value("pilot"))
        if state.fault:
            raise ValueError(state.fault)
        state.used.check_unused(participant, session)
        protocol, group, row_of = self.facts.protocol, self._value("group"), self._value("row_of")
        check_row(row_of, protocol)
        protocol.check_session_number(session)
        if protocol.asks_group and group is None:
            raise _ChoiceMissing("choose the participant's group")
        check_choice(protocol, state.held, participant, group=group, row_of=row_of)
        self.chosen()

    @cached_property
    def _document(self) -> Mapping[str, Any]:
        return read_document(source_bytes(self.facts.source), self.facts.source)[0]

    def _asked_options(self) -> set[str]:
        return {option.name for option in descriptor_of(self._value("device")).window_options}

    def chosen(self) -> NewSession:
        """Return the chosen session; raise ValueError if a value is invalid."""
        asked, options = self._asked_options(), {option.name for option in window_options()}
        values = {name: editor.value for name, editor in self.editors.items() if name in asked or name not in options}
        chosen = {name: values.pop(name) for name in asked}
        return NewSession(
            **values | {"results": Path(values["results"])},
            source=self.facts.source,
            device_options={name: value for name, value in chosen.items() if value},
        )


class WorkspaceDialog(Question):
    """A dialog that suggests a workspace folder; another one can be chosen. Nothing is created until acceptance."""

    def __init__(self, parent: QWidget, theme: Theme, offered: Path) -> None:
        super().__init__(
            parent,
            theme,
            "Choose your workspace",
            "This computer's protocols and results are stored in one folder. All windows and commands use this "
            "folder, wherever you start them. You can change it later under This machine.",
            ActionButton("check", "Use this folder", role="primary"),
            back="Not now",
            fields=(Field("workspace", "Workspace folder", "folder", hint=_HOLDS),),
            needs={"workspace": "Please choose a folder."},
            width=620,
        )
        self.setModal(True)
        self.path = self.editors["workspace"]
        self.path.show_value(str(offered))
        self.go_on.setFocus()

    @property
    def folder(self) -> Path:
        return Path(self.path.value).expanduser()
