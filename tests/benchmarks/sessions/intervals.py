"""How long the participant's pages take: each change of the tank within a trial, the answer page, a page of NASA-TLX.

Run it by itself: ``python tests/benchmarks/sessions/intervals.py [TRIALS]``. Every page is composed, shown and painted
in a window of 1366 × 768 without a screen; limits are those of 60 frames a second and of a page that seems immediate.
"""

import os
import sys
import time
from collections.abc import Sequence

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import numpy as np
from PySide6.QtWidgets import QApplication

from study_app.gui.participant.window import ParticipantWindow
from study_app.protocol.wording.languages import words
from study_app.session.pages import ChoicePage, Page, TaskPage
from study_app.session.transitions.commands import Command, ShowPage
from study_app.session.transitions.events import Begin
from study_app.session.transitions.state import FINAL, Phase
from study_app.session.transitions.table import advance
from tests.protocol.trials.level_studies import study
from tests.session import pairs

TRIALS = 40
CHANGE_MS = 16.0
ANSWER_MS = 100.0


TLX_MS = 50.0
TLX_PAGES = 30
WITH_TLX = ('sequence = ["viscosity"]', 'sequence = ["load", "viscosity"]')
TLX = '\n[questionnaires.load]\ninstrument = "nasa-tlx"\n'


def pages_of(commands: Sequence[Command]) -> list[Page]:
    """Return the pages that commands show."""
    return [command.page for command in commands if isinstance(command, ShowPage)]


def main(trials: int = TRIALS) -> None:
    """Go through trials and print the times."""
    app = QApplication.instance() or QApplication([])
    window = ParticipantWindow(words("en"), clock=lambda: 0.0, windowed=True)
    window.open_on()
    app.processEvents()

    def took_ms(pages: Sequence[Page], begun: tuple[float, float]) -> tuple[float, float]:
        for page in pages:
            window.show_page(page)
        app.processEvents()
        return (time.perf_counter() - begun[0]) * 1e3, (time.thread_time() - begun[1]) * 1e3

    state = pairs.opened(study())
    changes_ms: list[tuple[float, float]] = []
    answers_ms: list[tuple[float, float]] = []
    at_s = 0.0
    while state.phase not in FINAL and len(answers_ms) < trials:
        event = pairs.next_event(state, at_s)
        before = state.trial.number if state.phase in {Phase.TASK, Phase.RESTING} else None
        begun = time.perf_counter(), time.thread_time()
        state, commands = advance(state, event)
        pages = pages_of(commands)
        took = took_ms(pages, begun)
        at_s = max(at_s, getattr(event, "at_s", at_s)) + 100.0
        if pages and isinstance(pages[-1], TaskPage) and pages[-1].trial == before:
            changes_ms.append(took)
        elif pages and isinstance(pages[-1], ChoicePage):
            answers_ms.append(took)
    (form,) = pages_of(advance(pairs.opened(study(WITH_TLX, more=TLX)), Begin(0.0))[1])
    tlx_ms = [took_ms([form], (time.perf_counter(), time.thread_time())) for _ in range(TLX_PAGES)]
    for what, found, limit in (
        ("a change of the tank", changes_ms, CHANGE_MS),
        ("an answer page", answers_ms, ANSWER_MS),
        ("a page of NASA-TLX", tlx_ms, TLX_MS),
    ):
        (median, cpu), (p95, cpu95) = np.percentile(found, (50, 95), axis=0)
        print(f"{what}: median {median:.1f} ms, 95 % {p95:.1f} ms of {len(found)} (limit {limit:g} ms);", end=" ")
        print(f"of these on the processor {cpu:.1f} and {cpu95:.1f} ms")
    window.may_close = True
    window.close()


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
