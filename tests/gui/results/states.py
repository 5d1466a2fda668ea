"""Results, the export and a session's page in their states."""

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from PySide6.QtWidgets import QWidget

from study_app.analysis.worker_messages import FigureDrawn, Progress
from study_app.errors import StoreError
from study_app.gui.results.figures import Trouble, unblinding_text
from study_app.gui.sessions.session_page import SessionPage, SessionRecord, TrialRecord
from study_app.gui.theme.theme import DARK, LIGHT
from study_app.gui.theme.themed import apply_theme
from study_app.store.exclusions import Exclusion
from tests.gui.results.sample import LEFT_OUT, SVG, facts, view
from tests.gui.transcript import Actions, clicked, in_turn
from tests.gui.windows import results, show_window

NOW = datetime(2026, 11, 24, 12, tzinfo=UTC)
STARTED = NOW - timedelta(days=1)


def of_results(**changes: Any) -> Callable[[Any], None]:
    return lambda window: window.place("results").show_view(view(**changes))


def press_then_show(button: str, **changes: Any) -> Callable[[Any], None]:
    """Return an action that presses a button of the figures, then shows other results."""
    return in_turn(lambda window: clicked(f"figures.{button}")(window.place("results")), of_results(**changes))


FIGURES = view().figures
OPENED = unblinding_text({"at": STARTED.isoformat(), "by": "AK", "reason": "closed, " + "and so on " * 20})
PEOPLE = (
    facts("P001", status="damaged", validity=None),
    facts("P002", status="withdrawn", validity="invalid", answers=3, answers_of=62),
    facts("P003", excluded="fell asleep"),
    facts("P004", status="running", validity=None, session=2),
    facts("P005", status="aborted", reconnected=2, started=STARTED),
    facts("P006", simulated=False, pilot=True, outlets_lost=1, lost=3, started=NOW),
    facts("P007", simulated=False, status="broken", started=datetime(2025, 1, 2, 3, 4, tzinfo=UTC)),
)
RESULTS: Actions = {
    "all states": of_results(
        sessions=PEOPLE, left_out=(LEFT_OUT, replace(LEFT_OUT, participant="P005", trial=None, excluded_at="?"))
    ),
    "unblinded": of_results(sealed=False, opened=OPENED),
    "doubts": of_results(doubts=("P001/journal.jsonl", "P002/trials.csv"), chosen=Path("results/demo")),
    "pilot": of_results(studies=(replace(view().studies[0], pilot=True),)),
    "empty figure": of_results(figures=(replace(FIGURES[1], svg=b"", caption="No completed session."),)),
    "three figures": of_results(
        figures=(*FIGURES, FigureDrawn(name="third", title="Third", caption="Caption.", svg=SVG))
    ),
    "drawing": of_results(figures=(), drawing=Progress("drawing", 0.4)),
    "testing": of_results(testing=Progress("testing: Unusable", 0.7)),
    "untested": press_then_show("work.stop", untested=True),
    "trouble": press_then_show(
        "work.again",
        figures=(),
        trouble=Trouble(title="It cannot be", sentence="P002 is damaged.", button="Look", remedy="again"),
    ),
    "reading": press_then_show("trouble.button", sessions=(), figures=()),
    "no sessions": of_results(sessions=(), figures=(), listed=True),
    "no study": of_results(studies=(), chosen=None, sessions=(), figures=()),
    "stacked": lambda window: (window.resize(1024, 640), of_results()(window)),
}


def writing(qtbot: Any) -> QWidget:
    """Return the dialog that exports tables, over results in which SPSS files cannot be written."""
    window = results(qtbot).main
    window.place("results").export.click()
    dialog: QWidget = window.place("results").writing
    dialog.below = window  # type: ignore[attr-defined]  # or it would be collected here
    return dialog


WRITING: Actions = {
    "begun": lambda dialog: (dialog.editors["wide"].control.click(), dialog.go_on.click()),
    "progress": lambda dialog: dialog.show_progress("making the tables", 0.3),
    "refused": lambda dialog: dialog.show_refused("/somewhere cannot be written"),
    "again": lambda dialog: dialog.go_on.click(),
    "stopping": lambda dialog: dialog.back.click(),
    "written": lambda dialog: dialog.show_written(
        [Path("/there/a.csv"), Path("/there/b.csv")], [f"P00{n} is damaged" for n in range(5)]
    ),
    "opened": lambda dialog: dialog.go_on.click(),
}

TRIAL = TrialRecord(
    number=1,
    attempt=1,
    words="Part 1, L2",
    outcome="complete",
    valid=True,
    broken=(),
    answers=9,
    unconfirmed=(),
    notes="",
    lost="",
    excluded=None,
)
BROKEN = replace(
    TRIAL,
    number=2,
    words="Part 1, L1",
    outcome="timeout",
    valid=False,
    broken=("longest time between two ticks: 41.3 ms, limit 20 ms", "lateness of ticks: 2.5 ms, limit 2 ms"),
    unconfirmed=("feels_liquid: 5",),
    notes="phone rang",
)
RECORD = SessionRecord(
    facts=facts("P007", simulated=False),
    about="Device mouse  ·  language en",
    limits="Out of limits: 1 of 2 measured trials exceeded one of the study's limits.",
    trials=(
        TRIAL,
        BROKEN,
        replace(TRIAL, number=3, valid=None, outcome="running", answers=0, lost="its thread ended"),
        replace(TRIAL, number=4, excluded="phone rang", attempt=2),
    ),
    notes=("09:31, trial 2: phone rang",),
    files=(("journal.jsonl", 1_234_567), ("receipt.json", 90), ("trials.csv", 5400)),
    left_out=(
        Exclusion(
            participant="P007",
            session=1,
            trial=4,
            rule_or_person="AK",
            reason="phone rang",
            excluded_at=STARTED.isoformat(),
        ),
    ),
)
READ: dict[str, Any] = {}
"""What the page of a session reads: its record, or an error."""


def read(what: str) -> Any:
    """Return the record to read, or raise its error."""
    if isinstance(READ[what], Exception):
        raise READ[what]
    return READ[what]


def page(qtbot: Any) -> SessionPage:
    below = QWidget()
    qtbot.addWidget(below)
    session_page: Any = SessionPage(below, LIGHT, RECORD.facts, lambda _path: None)
    session_page.below = below
    return show_window(qtbot, session_page, (1040, 700))  # type: ignore[no-any-return]


def read_again(**changed: Any) -> Callable[[Any], None]:
    def act(session_page: Any) -> None:
        READ.update(changed)
        session_page.read_folder()

    return act


PAGE: Actions = {
    **{f"trial {row + 1}": lambda session_page, row=row: session_page.trials.selectRow(row) for row in (1, 2, 3)},  # type: ignore[misc]
    "sealed": read_again(record=replace(RECORD, left_out=(), notes=())),
    "session excluded": read_again(
        record=replace(
            RECORD,
            facts=facts("P007", status="withdrawn", validity="invalid", excluded="asleep"),
            left_out=(
                Exclusion(
                    participant="P007",
                    session=1,
                    trial=None,
                    rule_or_person="AK",
                    reason="asleep",
                    excluded_at=STARTED.isoformat(),
                ),
            ),
        )
    ),
    "empty": read_again(record=replace(RECORD, trials=(), files=())),
    "unreadable": read_again(record=StoreError("the journal cannot be read")),
    "dark": lambda session_page: apply_theme(session_page, DARK),
}
