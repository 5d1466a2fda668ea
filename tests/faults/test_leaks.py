"""A whole session: no readable file reveals a condition, nor does a window while the study is double-blind."""

import logging
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from PySide6.QtWidgets import QApplication

from study_app import app
from study_app.gui.operator.window import OperatorWindow
from study_app.gui.participant.window import ParticipantWindow
from study_app.protocol.load import load
from study_app.session import start
from study_app.session.pages import TaskPage
from study_app.store import receipt
from study_app.store.blinded.blinding import open_events, read_key
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.verification.leaks import Telltales, find_leaks, presented_numbers, recorded_numbers, telltales
from tests.compiled import needs_servo
from tests.faults.support import short
from tests.faults.support.watched_program import Person, traces_of, words_of
from tests.protocol.trials.level_studies import BLOCK, HEAD

pytestmark = [pytest.mark.slow, needs_servo, pytest.mark.usefixtures("qapp")]

# Ids, parameters and delays that occur nowhere by chance.
CONCEALED = (
    (r"\bliquids\.thin\b", "liquids.quagmire"),
    (r"\bliquids\.thick\b", "liquids.mildew"),
    (r'liquid = "thin"', 'liquid = "quagmire"'),
    (r'liquid = "thick"', 'liquid = "mildew"'),
    (r"conditions\.thin\b", "conditions.feel_quagmire"),
    (r"conditions\.thick\b", "conditions.feel_mildew"),
    (r"conditions\.prompt\b", "conditions.see_brisk"),
    (r"conditions\.late\b", "conditions.see_tardy"),
    (r'\["thin", "thick"\]', '["feel_quagmire", "feel_mildew"]'),
    (r'\["prompt", "late"\]', '["see_brisk", "see_tardy"]'),
    (r"density_kg_m3 = 1000\b", "density_kg_m3 = 1013.7"),
    (r"density_kg_m3 = 1400\b", "density_kg_m3 = 1391.3"),
    (r"length = 1700\b", "length = 1717"),
    (r"scaling = 1700\b", "scaling = 1931"),
    (r"exponent = 0\.75", "exponent = 0.7513"),
    (r"delay_ms = 200\b", "delay_ms = 137.31"),
)


@pytest.fixture(params=["double", "single"])
def blinding(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def concealed(tmp_path: Path, blinding: str) -> Path:
    path = short.write(tmp_path)
    text = path.read_text(encoding="utf-8")
    for pattern, word in (*CONCEALED, (r'blinding = "double"', f'blinding = "{blinding}"')):
        text, count = re.subn(pattern, word, text)
        assert count, pattern
    path.write_text(text, encoding="utf-8", newline="\n")
    return path


@dataclass
class HeldSession:
    """The messages of a session, and the contents of its windows."""

    words: set[str] = field(default_factory=set)
    messages: list[str] = field(default_factory=list)
    tasks: set[int] = field(default_factory=set)
    forces_plotted: set[bool] = field(default_factory=set)


def hold_session(
    protocol: Path, results: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> HeldSession:
    """Hold a session of the scripted device to its end; read every window at every look."""
    monkeypatch.setattr(start, "MEASURED_S", 0.1)
    caplog.set_level(logging.DEBUG)
    session = HeldSession()

    def watch(participant: ParticipantWindow, operator: OperatorWindow) -> bool:
        for top in QApplication.topLevelWidgets():
            session.words.update(words_of(top))
        session.words.update(traces_of(operator))
        session.words.add(repr(participant.page))
        if isinstance(participant.page, TaskPage):
            session.tasks.add(participant.page.trial)
            operator.ask("mark")
        session.forces_plotted.add(hasattr(operator.force, "plot"))
        return False

    person = Person(watch)
    code = app.run(
        str(protocol),
        participant="P001",
        device="scripted",
        windowed=True,
        seed=3,
        operator="AK",
        results=results,
        progress=session.messages.append,
    )
    person.leave()
    assert code == 0
    session.messages += [record.getMessage() for record in caplog.records]
    return session


def test_nothing_seen_written_or_logged_tells_a_condition(
    concealed: Path, blinding: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    results = tmp_path / "results"
    session = hold_session(concealed, results, monkeypatch, caplog)
    assert session.tasks == {1, 2, 3, 4}
    words = telltales(load(str(concealed)))
    assert {"quagmire", "1013.7", "1717", "137.31", "see_tardy"} <= words.words
    visible_words = words
    if blinding == "single":  # the operator sees forces and counts, which may be any short number
        visible_words = Telltales(word for word in words.words if not word[0].isdigit() or len(word) > 5)
    for text in (*session.words, *session.messages):
        assert visible_words.in_text(text) == [], text
    assert find_leaks(results, words) == []
    assert session.forces_plotted == {blinding == "single"}
    assert [
        receipt.read(folder.receipt)["protocol"]["study"]["blinding"] for folder in StudyFolder(results).sessions()
    ] == [blinding]
    assert len(session.words) > 100


# Levels, standards and parameters that occur nowhere by chance.
EDITS = (
    ("viscosity_pa_s = 1\n", "viscosity_pa_s = 1.3717\n"),
    ("viscosity_pa_s = 4\n", "viscosity_pa_s = 4.1213\n"),
    ("density_kg_m3 = 1000\n", "density_kg_m3 = 1013.7\n"),
    ("density_kg_m3 = 1260\n", "density_kg_m3 = 1261.9\n"),
    ("delay_ms = 100", "delay_ms = 137.31"),
    ("standards = [1, 2]", "standards = [1.3717, 2.1193]"),
    ("levels = [0.1, 0.8]", "levels = [0.1131, 0.8173]"),
    ("levels = [0.2, 0.4, 0.8]\nrepetitions = 8", "levels = [0.2371, 0.7793]\nrepetitions = 1"),
    ("min_s = 1\nmax_s = 3", "min_s = 0.2\nmax_s = 0.5"),
    ("liquids.thin", "liquids.quagmire"),
    ("liquids.thick", "liquids.mildew"),
    ('liquid = "thin"', 'liquid = "quagmire"'),
    ('liquid = "thick"', 'liquid = "mildew"'),
    ("conditions.oil", "conditions.feel_quagmire"),
    ('condition = "oil"', 'condition = "feel_quagmire"'),
    ("conditions.other", "conditions.feel_mildew"),
    ("conditions.late", "conditions.see_tardy"),
)
STAIRCASE = (
    'kind = "constant"\nlevels = [0.2371, 0.7793]\nrepetitions = 1',
    'kind = "updown"\ntrials = 4\nbegin = 0.6917\nstep_up = 1.2131',
)
CATCH = ('method = "few"', 'method = "few"\ncatch = { share = 0.25 }')
KNOWN = {0.2371, 2.1193, 1.3717 + 1.3717 * 0.2371}


@pytest.mark.parametrize(
    ("edits", "known"),
    [
        pytest.param((), KNOWN, id="constant"),
        pytest.param(
            (STAIRCASE, CATCH), {0.6917, 2.1193, 1.3717 + 1.3717 * 0.6917}, id="staircase", marks=pytest.mark.nightly
        ),
    ],
)
def test_nothing_seen_written_or_logged_tells_a_level(
    edits: Sequence[tuple[str, str]],
    known: set[float],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    text = HEAD + BLOCK
    for old, new in (*EDITS, *edits):
        assert old in text, old
        text = text.replace(old, new)
    path = tmp_path / "levels.toml"
    path.write_text(text, encoding="utf-8", newline="\n")
    session = hold_session(path, tmp_path / "results", monkeypatch, caplog)
    protocol = load(str(path))
    (place,) = StudyFolder(tmp_path / "results").sessions()
    recorded = recorded_numbers(protocol, open_events(journal.read(place.journal), read_key(tmp_path / "results")))
    assert known <= presented_numbers(protocol) | recorded
    words = telltales(protocol, recorded)
    for line in (*session.words, *session.messages):
        assert words.in_text(line) == [], line
    assert find_leaks(tmp_path / "results", words) == []
    assert any("answered" in line for line in session.words), "the operator saw how the track is doing"
