"""Levels that a participant set follow from the steps, every force from the recording; whoever changes one is found."""

import shutil
from pathlib import Path
from typing import Any

import pytest

from study_app.session.replay import replay
from study_app.session.simulated.rehearsal import rehearse, resume_rehearsal
from study_app.session.watch import read_watched
from study_app.store.blinded.blinding import complete_protocol, open_events, read_key
from study_app.store.journals import journal
from study_app.store.receipt import read
from study_app.store.unblinding import unblind
from study_app.store.verification.leaks import certain_telltales, find_leaks, recorded_numbers
from study_app.store.verification.reproduction import reproduce_session
from study_app.store.verification.whole_study import verify_study
from tests.compiled import needs_servo
from tests.journal_lines import event_from, raw
from tests.protocol.trials.matching import ALONE, DELAY, text_of
from tests.store.forging import cut

pytestmark = [pytest.mark.slow, needs_servo]

SHORT = ("repetitions = 4", "repetitions = 3")
WATER = (
    'drag = { law = "linear", damping_nspm = 6 }',
    """density_kg_m3 = 1000
viscosity_pa_s = 1
effects = ["drag", "wake"]
drag = { law = "haider-levenspiel" }
wake = { length = 400, scaling = 1000, exponent = 0.5, breaking_angle_deg = 45, breaking_span_m = 0, decay = 0.99 }""",
)
VISCOSITY = (DELAY[0], 'vary = "viscosity_pa_s"\nlevel = "value"\nlevels = [0.4, 2.5]')


@pytest.fixture(scope="module")
def protocol(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("protocol") / "matching.toml"
    path.write_text(text_of(SHORT), encoding="utf-8", newline="\n")
    return path


@pytest.fixture(scope="module")
def study(protocol: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return rehearse(protocol, participants=1, seed=2, results=tmp_path_factory.mktemp("matching") / "study")


@pytest.fixture
def session(study: Path, tmp_path: Path) -> Path:
    """Return the session in a copy of the study, which may be changed."""
    shutil.copytree(study, tmp_path / "study")
    return session_of(tmp_path / "study")


def session_of(study: Path) -> Path:
    return next((study / "data").glob("sub-*/ses-*"))


def lines_of(session: Path) -> list[dict[str, Any]]:
    return raw(open_events(journal.read(session / "journal.jsonl"), read_key(session.parents[2])))


@pytest.mark.parametrize(
    "share", [0.25, *(pytest.param(share, marks=pytest.mark.nightly) for share in (0.5, 0.75)), 0.95]
)
def test_a_session_that_was_killed_and_resumed_is_set_as_one_that_was_not(
    session: Path, protocol: Path, share: float
) -> None:
    def kept() -> tuple[list[Any], list[Any]]:
        lines = lines_of(session)
        last = {line["trial"]: line for line in lines if line["event"] == "trial_started"}
        sets = {line["trial"]: line["setting"] for line in lines if line.get("setting") is not None}
        answers = {line["trial"]: line["items"][0]["value"] for line in lines if line["event"] == "responses"}
        return [(n, line["level"], sets[n]) for n, line in sorted(last.items())], sorted(answers.items())

    whole = kept()
    cut(session, round(share * (session / "journal.jsonl").stat().st_size))
    resume_rehearsal(session, protocol=protocol)
    assert [row[:2] for row in kept()[0]] == [row[:2] for row in whole[0]]
    assert kept() == whole
    assert reproduce_session(session).differences == []
    assert replay(session).differences == ()


@pytest.mark.parametrize(
    "edits", [(ALONE, DELAY), (WATER, VISCOSITY), (ALONE,)], ids=["delay", "viscosity with a wake", "alone"]
)
def test_other_numbers_are_set_and_proved(edits: tuple[tuple[str, str], ...], tmp_path: Path) -> None:
    unjudged = ("[liquids", "[limits]\nwithheld_percent = 100\nlevel_error_percent = 100\n\n[liquids")
    path = tmp_path / "matching.toml"
    path.write_text(text_of(SHORT, unjudged, *edits), encoding="utf-8", newline="\n")
    session = session_of(rehearse(path, participants=1, seed=5, results=tmp_path / "study"))
    assert reproduce_session(session).differences == []
    proved = replay(session)
    assert (proved.differences, proved.uncompared) == ((), ())
    lines = lines_of(session)
    scenes = {line["scene"] is None for line in lines if line["event"] == "stepped"}
    assert scenes == {DELAY in edits}
    assert sum(line["event"] == "responses" for line in lines) == 3
    unblind(tmp_path / "study", by="AK", reason="a test")
    start_line = [line for line in lines if line["event"] == "interval_started" and line["trial"] == 1][-1]
    watched = read_watched(session, 1, interval=start_line["interval"])
    assert watched.ends_s == max(watched.times_s[-1], watched.marks[-1].at_s)
    zero_s = watched.samples["time_ns"][0] * 1e-9 - watched.times_s[0]
    origin_ns = read(session / "receipt.json")["clock"]["origin_ns"]
    assert zero_s - origin_ns * 1e-9 == pytest.approx(start_line["t_s"], abs=0.005)


def test_levels_that_were_set_are_searched_for_and_not_found(study: Path) -> None:
    lines, key = lines_of(session_of(study)), read_key(study)
    protocol = complete_protocol(read(session_of(study) / "receipt.json")["protocol"], key)
    numbers = recorded_numbers(protocol, map(event_from, lines))
    assert {line["setting"] for line in lines if line.get("setting") is not None} <= numbers
    assert len(numbers) > sum(line["event"] == "trial_started" for line in lines) + 6
    words = certain_telltales(key.tables, {}, numbers)
    assert find_leaks(study, words) == []
    assert words.in_text(f"{lines[-1]['n']} {max(numbers - {18.0})!r}")


def test_a_level_that_was_set_is_found_in_a_note(session: Path) -> None:
    level = next(line["setting"] for line in lines_of(session) if len(str(line.get("setting"))) > 6)
    (session / "note.txt").write_text(f"it was {level!r}", encoding="utf-8", newline="\n")
    warnings = [str(warning) for warning in verify_study(session.parents[2], None).warnings]
    assert any("note.txt, line 1 reveals a condition, although the key is sealed" in warning for warning in warnings)
