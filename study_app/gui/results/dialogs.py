"""The dialogs of the results page: exports, exclusions, unblinding."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

from PySide6.QtWidgets import QWidget

from study_app.gui.kit.dialogs import REASON, Question, Work
from study_app.gui.kit.fields import Field, choice_field
from study_app.gui.results.figures import exclusion_text
from study_app.gui.sessions.session_facts import SessionFacts
from study_app.gui.theme.theme import Theme
from study_app.gui.widgets.controls import ActionButton
from study_app.number_text import counted
from study_app.store.exclusions import Exclusion

_WIDTH, _QUESTION_PX = 600, 560
_WARNED = 3
"""The maximum number of files that differ from the record and are named."""


class Extra(NamedTuple):
    """An optional output: its name in the command, its label, and the reason why it is unavailable, or ""."""

    name: str
    words: str
    why_not: str = ""


class WriteDialog(Work):
    """A dialog that asks for a folder and outputs, then shows the progress of writing them.

    Parameters
    ----------
    to : the suggested folder
    extras : the optional outputs
    opens_file : whether to open the first file instead of the folder
    """

    def __init__(
        self, *arguments: Any, go_on: str, to: Path, extras: Sequence[Extra] = (), opens_file: bool = False
    ) -> None:
        checks = (Field(extra.name, extra.words, "check", hint=extra.why_not) for extra in extras)
        folder = Field("to", "Folder", "folder", hint="Existing files will be overwritten.")
        super().__init__(
            *arguments,
            ActionButton("", go_on, role="primary"),
            fields=(*checks, folder),
            needs={"to": "Please choose a folder."},
            width=_WIDTH,
        )
        self._opens_file = opens_file
        self.result_path: Path | None = None
        self._extras = [extra.name for extra in extras]
        for extra in extras:
            self.editors[extra.name].control.setEnabled(not extra.why_not)
        self.editors["to"].show_value(str(to))
        self.go_on.setFocus()

    @property
    def asked(self) -> tuple[Path, tuple[str, ...]]:
        """The chosen folder, and the names of the chosen extras."""
        return Path(self.value("to")).expanduser(), tuple(name for name in self._extras if self.value(name))

    def show_written(self, files: Sequence[Path], warnings: Sequence[str]) -> None:
        self.result_path = files[0] if self._opens_file else self.asked[0]
        more = f" {len(warnings) - _WARNED} more." if len(warnings) > _WARNED else ""
        opens = "Open the report" if self._opens_file else "Open the folder"
        warned = "".join(f"\n{line}" for line in warnings[:_WARNED])
        self.show_done(f"{counted(len(files), 'file')} in {files[0].parent}.{warned}{more}", opens)


_NEEDS: Final = {"by": "Please enter a name. It will be recorded.", "reason": REASON}


def _decision_fields(person_label: str, example: str) -> tuple[Field, Field]:
    """Return the fields for the name of the person who decides, and the reason."""
    person = Field("by", person_label, placeholder="Your name or initials, such as AK")
    return person, Field("reason", "Reason", placeholder=f"For example: {example}")


class LeaveOutDialog(Question):
    """A dialog that asks which session or trial to exclude, who decides, and why.

    Parameters
    ----------
    sessions : the sessions that are not excluded yet
    trials : the main trials of each session (participant, number) with their labels
    chosen : the initially selected session
    proposed : an exclusion that a rule proposes
    """

    def __init__(
        self,
        parent: QWidget,
        theme: Theme,
        sessions: Sequence[SessionFacts],
        trials: Mapping[tuple[str, int], tuple[tuple[int, str], ...]],
        chosen: SessionFacts | None,
        proposed: Exclusion | None = None,
    ) -> None:
        super().__init__(
            parent,
            theme,
            "Exclude from the analysis",
            f"{_rule_sentence(proposed)}The chosen session or trial is excluded from measures, figures and tests. No "
            "data are deleted; exclusions.csv and every report state what was excluded, who excluded it and why.",
            ActionButton("minus", "Exclude", role="primary"),
            fields=(
                choice_field(
                    "session", "Session", {(facts.participant, facts.session): facts.name for facts in sessions}
                ),
                choice_field("trial", "Scope", {}),
                *_decision_fields("By", "fell asleep"),
            ),
            needs=_NEEDS,
            width=_QUESTION_PX,
        )
        self._trials, self._proposed = trials, proposed
        if chosen is not None:
            self.editors["session"].show_value((chosen.participant, chosen.session))
        self.editors["session"].edited.connect(self._show_trials)
        self._show_trials()
        if proposed is not None:
            self.editors["session"].show_value((proposed.participant, proposed.session))
            self._show_trials()
            self.editors["reason"].show_value(proposed.reason)

    def _show_trials(self) -> None:
        trials = self._trials.get(self.value("session"), ())
        self.editors["trial"].show_options(
            {None: "Whole session", **{number: f"Trial {number}: {text}" for number, text in trials}}
        )

    @property
    def chosen(self) -> tuple[str, int, int | None]:
        """Participant, session and trial; the trial is None for the whole session."""
        return *self.value("session"), self.value("trial")

    @property
    def rule(self) -> str:
        """The rule that proposed the chosen session; "" for a person's own decision."""
        proposed = self._proposed
        return "" if proposed is None or self.chosen != proposed.what else proposed.rule_or_person


def _rule_sentence(proposed: Exclusion | None) -> str:
    if proposed is None:
        return ""
    return f"{exclusion_text(proposed)} meets the exclusion rule “{proposed.rule_or_person.replace('_', ' ')}”. "


def unblind_question(parent: QWidget, theme: Theme, study: str, incomplete: int) -> Question:
    """Return the dialog that asks whether to unblind a study; ``incomplete`` counts its incomplete sessions."""
    count = "1 session is" if incomplete == 1 else f"{incomplete} sessions are"
    warning = (
        f"{count} not complete. Operators of the remaining sessions will no longer be blinded." if incomplete else ""
    )
    return Question(
        parent,
        theme,
        f"Unblind {study}?",
        "Everyone who opens this study will see which condition each code stands for, here and in every "
        "table, figure and report. This cannot be undone. Your name, the reason and the time are stored "
        "with the data.",
        ActionButton("eye", "Unblind", role="danger"),
        fields=_decision_fields("Name", "collection closed"),
        needs=_NEEDS,
        warning=warning,
        width=_QUESTION_PX,
    )


def take_back_question(parent: QWidget, theme: Theme, exclusion: Exclusion) -> Question:
    """Return the dialog that asks whether to reverse an exclusion, or to reject a proposed one."""
    proposed = not exclusion.excluded_at
    action = "Keep" if proposed else "Include again"
    why = (
        f"A rule proposed this exclusion: {exclusion.reason}. The data will remain in measures, figures and tests."
        if proposed
        else f"Reason for the exclusion: “{exclusion.reason}”. The data will be included again in measures, "
        "figures and tests."
    )
    return Question(
        parent,
        theme,
        f"{action}: {exclusion_text(exclusion)}",
        f"{why} Your name, the reason and the time are stored in exclusions_reversed.jsonl.",
        ActionButton("undo", action, role="primary"),
        fields=_decision_fields("By", "wrong participant"),
        needs=_NEEDS,
        width=_QUESTION_PX,
    )
