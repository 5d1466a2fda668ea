"""While a shipped study is sealed, no number in its files tells what a trial presented, but for times of actions."""

from pathlib import Path
from typing import Any

import pytest

from study_app.protocol.load import load
from study_app.protocol.source.files import shipped
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.blinded.blinding import open_events, read_key
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.journals.journal_events import TrialStarted
from tests.compiled import needs_servo
from tests.journal_lines import raw
from tests.session.sealed.numbers_written import Trials, every_number, told

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900), needs_servo]

PEOPLE = 3  # with 2 a journal that tells the later interval by its targets passes
QUICK = "delaydetect"  # whose journals told the later interval by its targets
STUDIES = [pytest.param(name, marks=() if name == QUICK else pytest.mark.nightly) for name in shipped()]


def presented_in(folder: Path, block: str) -> Trials:
    """Return every number about each trial of a block, with its condition, or the order of its intervals."""
    key, numbers = read_key(folder), {}
    for session in StudyFolder(folder).sessions():
        lines = journal.read(session.journal)
        start_lines = {line.n: line for line in open_events(lines, key) if isinstance(line, TrialStarted)}

        def presented(line: dict[str, Any], of: dict[int, TrialStarted] = start_lines) -> str | None:
            trial = of[line["n"]]
            if trial.block != block or trial.phase != "main" or trial.catch:
                return None
            return trial.arrangement or key.codes[block][trial.code]

        numbers |= every_number(session, folder.name, raw(lines), presented)
    return numbers


@pytest.mark.parametrize("study", STUDIES)
def test_written_numbers_of_shipped_studies_do_not_predict_conditions(study: str, tmp_path: Path) -> None:
    folder = rehearse(study, participants=PEOPLE, seed=31, results=tmp_path / study, recordings=False)
    for block in load(study).blocks:
        trials = presented_in(folder, block)
        if len({what for what, _ in trials.values()}) > 1:
            right, of, p = told(trials)
            assert p > 0.01, f"block {block}: {right} of {of} trials were told (p = {p:.2g})"
