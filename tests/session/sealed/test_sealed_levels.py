"""Two rehearsals whose keys differ write and show the same, but for what is sealed; numbers tell no level."""

import csv
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import pytest

from study_app.gui.operator.operator_view import Session, stages, view_session
from study_app.gui.operator.servo_health import Vitals
from study_app.protocol.load import load
from study_app.protocol.orders.schedule import build_schedule
from study_app.protocol.randomization.streams import stream
from study_app.protocol.simulated import NO_FEATURES, Comparison
from study_app.session.simulated.rehearsal import RehearsedSession, rehearse
from study_app.store.blinded import blinding
from study_app.store.blinded.blinding import open_or_draw_key, read_key
from study_app.store.files.columns import SEALED
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.journals.journal_events import IntervalEnded, Recorded
from study_app.store.session_progress.progress import Progress
from study_app.store.unblinding import unblind
from tests.compiled import needs_servo
from tests.journal_lines import raw
from tests.outlets.collector import collecting
from tests.protocol import edited_studies
from tests.protocol.trials.level_studies import SHORT, text_of
from tests.session.sealed.numbers_written import Trials, every_number, told

pytestmark = [pytest.mark.nightly, pytest.mark.slow, needs_servo]

SESSIONS = 12
HIDDEN = {"sealed", "resolved", "key_hash", "receipt_hash", "at", "previous", "fingerprint", "sha256", "frames_sha256"}
"""What may differ: sealed fields, hashes, and the time of day."""

Said: TypeAlias = dict[str, Any]

STATEMENTS = """
[scales.agreement]
labels.en = ["1", "2", "3", "4", "5", "6", "7"]
[questionnaires.felt]
intro = "Do you agree?"
scale = "agreement"
items = [{ id = "thick", text = "It is thick.", short = "Thick" }]
[blocks.said]
task = "stir"
conditions = ["oil", "other"]
repetitions = 4
order = "shuffled"
questionnaire = "felt"
"""


@pytest.fixture(scope="module")
def protocol(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("levels") / "levels.toml"
    path.write_text(
        edited_studies.text_of("every_design").replace('"expected"]', '"expected", "said"]') + STATEMENTS,
        encoding="utf-8",
        newline="\n",
    )
    return path


def answer_blindly(
    _self: object, _study: object, design: Any, _s: Any, _b: Any, draw: Callable[[], float], _course: Any
) -> Any:
    """Answer at random, independent of the force."""
    share = draw()
    if design.reply == "choice":
        return design.answers[int(share * len(design.answers))]
    return 1 + int(share * 3) if design.reply == "rating" else round(1 + 9 * share, 2)


class BlindSetting:
    """An observer with random steps, independent of the force; some pass the nearer end."""

    def __init__(self, _attended: Any, draw: Callable[[], float]) -> None:
        self._steps = [*[1] * 7, 80, -90, -7, 3, *(round(9 * draw()) - 4 or 1 for _ in range(4)), 0]

    def steps(self, _sensed: float, _standard: float) -> int:
        return self._steps.pop(0)


def run(protocol: Path, folder: Path, secret: int) -> Path:
    """Rehearse a session under a key drawn from ``secret``; put its markers where its files are."""
    folder.mkdir(parents=True)
    open_or_draw_key(folder, load(str(protocol)), stream(secret, "blinding").random)
    with collecting() as markers:
        rehearse(protocol, participants=1, seed=4, results=folder)
    (folder / "markers.jsonl").write_text(
        "".join(f"{marker.text}\n" for marker in markers.markers), encoding="utf-8", newline="\n"
    )
    return folder


@pytest.fixture(scope="module")
def blind_answers() -> Any:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Comparison, "answer", answer_blindly)
        patch.setattr(RehearsedSession, "_perceived_features", lambda _self, _trial: NO_FEATURES)
        patch.setattr("study_app.session.simulated.participant.AdjustingObserver", BlindSetting)
        yield patch


@pytest.fixture(scope="module")
def first(protocol: Path, blind_answers: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return run(protocol, tmp_path_factory.mktemp("first") / "study", 1)


@pytest.fixture(scope="module")
def second(protocol: Path, blind_answers: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return run(protocol, tmp_path_factory.mktemp("second") / "study", 3)


def said_in(folder: Path) -> Said:
    """Return the content of every file of a study except the key and fields that may differ."""
    contents: Said = {}
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if path.is_dir() or path.name in {"key.sealed", "checksums.sha256", "fingerprints.txt"}:
            contents[name] = None
        elif path.suffix == ".csv":
            with path.open(newline="", encoding="utf-8") as file:
                contents[name] = [
                    {column: cell for column, cell in row.items() if not column.endswith("_at")}
                    for row in csv.DictReader(file)
                ]
        elif path.suffix == ".parquet":
            contents[name] = path.stat().st_size
        else:
            text = path.read_text(encoding="utf-8")
            parts = text.splitlines() if path.suffix == ".jsonl" else [text]
            contents[name] = (
                [without_hidden(json.loads(part)) for part in parts] if path.suffix.startswith(".json") else text
            )
            if path.name == "journal.jsonl":  # the recorder writes its own lines whenever it is done
                rest = [{**line, "n": 0} for line in contents[name] if line["event"] != "recorded"]
                saved = [{**line, "n": 0, "t_s": 0} for line in contents[name] if line["event"] == "recorded"]
                contents[name] = rest + sorted(saved, key=lambda line: str(line["recording"]))
    return contents


def without_hidden(value: Any) -> Any:
    if isinstance(value, dict):
        return {
            name: without_hidden(inner)
            for name, inner in value.items()
            if name not in HIDDEN and not name.endswith("_at")
        }
    return [without_hidden(inner) for inner in value] if isinstance(value, list) else value


def operator_views(folder: Path, protocol: Path) -> list[Any]:
    """Return all that the operator saw of a session, event by event."""
    study = load(str(protocol))
    schedule = build_schedule(study, "P001", 4)
    session = Session(study, schedule, stages(study, schedule), "P001", 60.0, 40, 0.002, "scripted", "hand", ())
    progress = Progress()
    views = []
    (place,) = StudyFolder(folder).sessions()
    for line in journal.read(place.journal):
        if isinstance(line, Recorded):  # whenever the recorder is done
            continue
        progress.process_line(line)
        views.append(view_session(session, progress, Vitals(), now_s=line.t_s, force_on=True))
    return views


def presented_levels(folder: Path) -> list[Any]:
    """Return level and arrangement of each trial, and the condition of those of statements."""
    (place,) = StudyFolder(folder).sessions()
    lines, codes = (
        raw(blinding.open_events(journal.read(place.journal), read_key(folder))),
        read_key(folder).codes["said"],
    )
    start_lines = [line for line in lines if line["event"] == "trial_started"]
    return [(line.get("level"), line.get("arrangement"), codes.get(line["code"], "")) for line in start_lines]


def test_sessions_under_two_keys_present_different_levels_and_conditions(first: Path, second: Path) -> None:
    first_levels, second_levels = presented_levels(first), presented_levels(second)
    assert len(first_levels) == len(second_levels) > 30
    assert sum(it != another for it, another in zip(first_levels, second_levels, strict=True)) > 15
    assert [trial[2] for trial in first_levels if trial[2]] != [trial[2] for trial in second_levels if trial[2]]


def test_sessions_under_two_keys_write_the_same_but_for_sealed_fields(first: Path, second: Path) -> None:
    first_lines, second_lines = said_in(first), said_in(second)
    assert len(first_lines) > 8
    assert {name for name in first_lines if first_lines[name] != second_lines.get(name)} | (
        set(second_lines) - set(first_lines)
    ) == set()


def test_a_planted_leak_makes_them_differ(first: Path, protocol: Path, blind_answers: Any, tmp_path: Path) -> None:
    """One measure of one event is left unsealed."""
    with blind_answers.context() as patch:
        left = {**blinding._SEALED_FIELDS, IntervalEnded: SEALED - {"force_peak_n"}}
        patch.setattr(blinding, "_SEALED_FIELDS", left)
        other = said_in(run(protocol, tmp_path / "planted", 3))
    lines = said_in(first)
    assert {name.rpartition("/")[2] for name in lines if lines[name] != other.get(name)} == {"journal.jsonl"}


def test_the_operator_sees_the_same_under_two_keys(first: Path, second: Path, protocol: Path) -> None:
    views = operator_views(first, protocol)
    assert views == operator_views(second, protocol)
    assert any(view.track for view in views)


@pytest.fixture(scope="module")
def sessions(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a study with one block of pairs, answered from the simulated forces."""
    folder = tmp_path_factory.mktemp("pairs")
    path = folder / "pairs.toml"
    path.write_text(text_of(("repetitions = 8", "repetitions = 4"), *SHORT[1:]), encoding="utf-8", newline="\n")
    return rehearse(path, participants=SESSIONS, seed=6, results=folder / "study", recordings=False)


def numbers_of(folder: Path, what: str) -> Trials:
    """Return every number written about each trial, with its ``what``: level, standard or arrangement."""
    key = read_key(folder)
    numbers: Trials = {}
    for session in StudyFolder(folder).sessions():
        lines = journal.read(session.journal)
        presented = {line["n"]: line for line in raw(blinding.open_events(lines, key))}
        numbers |= every_number(session, "levels", raw(lines), lambda line, of=presented: str(of[line["n"]][what]))
    return numbers


@pytest.mark.parametrize("what", ["level", "standard", "arrangement"])
def test_written_numbers_do_not_predict_the_presented_levels(sessions: Path, what: str) -> None:
    right, trials, p = told(numbers_of(sessions, what))
    assert trials == SESSIONS * 24
    assert p > 0.01, f"{right} of {trials} trials were told (p = {p:.2g})"


@pytest.mark.parametrize("what", ["level", "standard", "arrangement"])
def test_written_numbers_predict_levels_after_unblinding(sessions: Path, tmp_path: Path, what: str) -> None:
    """This proves that the search can succeed and that the sealed values exist."""
    folder = tmp_path / "opened"
    shutil.copytree(sessions, folder)
    assert unblind(folder, "AB", "to see that it tells").left == ()
    right, trials, p = told(numbers_of(folder, what))
    assert p < 0.005, f"{right} of {trials} trials were told (p = {p:.2g})"
