"""Sessions whose force is sent late, with jitter and loss: replayed to the last bit, and delivered as requested."""

import shutil
from pathlib import Path

import pytest

from study_app.analysis.data.blocks import setting_name
from study_app.analysis.data.study_tables import load_study
from study_app.analysis.levels.evaluate import level_results, level_section
from study_app.analysis.levels.tracks import tracks
from study_app.protocol.load import parse
from study_app.protocol.presented.presentation import recorded_presentation
from study_app.session import replay as replay_module
from study_app.session.replay import replay
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.blinded.blinding import open_events, read_key
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.unblinding import unblind
from tests.compiled import needs_servo
from tests.journal_lines import raw
from tests.protocol.edited_studies import text_of

pytestmark = [pytest.mark.slow, needs_servo]

STUDY = text_of("late_forces")


@pytest.fixture(scope="module")
def rehearsed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("late")
    protocol = folder / "late.toml"
    protocol.write_text(STUDY, encoding="utf-8", newline="\n")
    return rehearse(protocol, participants=1, seed=2, results=folder / "study")


def test_every_force_of_a_link_is_computed_again_to_its_checksum(rehearsed: Path) -> None:
    (session,) = StudyFolder(rehearsed).sessions()
    replay_result = replay(session.path)
    assert replay_result.differences == replay_result.missing == replay_result.uncompared == ()
    assert replay_result.recordings == 6
    assert replay_result.proved


def test_another_seed_of_the_link_is_found(rehearsed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(replay_module, "link_seed", lambda *_: 1)
    (session,) = StudyFolder(rehearsed).sessions()
    assert any("the force on the hand differs" in difference for difference in replay(session.path).differences)


def test_the_session_measures_the_delays_that_were_requested(rehearsed: Path) -> None:
    (session,) = StudyFolder(rehearsed).sessions()
    key, protocol = read_key(rehearsed), parse(STUDY.encode(), "late.toml")
    lines = raw(open_events(journal.read(session.journal), key))
    start_lines = {line["trial"]: line for line in lines if line["event"] == "trial_started"}
    ended = [line for line in lines if line["event"] == "interval_ended"]
    assert len(ended) == 6
    errors_ms = []
    for line in ended:
        interval = recorded_presentation(protocol, key.codes, start_lines[line["trial"]]).intervals[
            line["interval"] - 1
        ]
        assert "invalid" not in line
        if interval.vary == "force_delay_ms":
            errors_ms.append(line["value_delivered"] - interval.value)
    assert len(errors_ms) == 4
    assert max(errors_ms) - min(errors_ms) < 2  # what both share is the jitter, 2.5 ms on average
    assert sum(errors_ms) / 4 == pytest.approx(2.5, abs=1)


def test_the_analysis_reports_delivered_delays_and_withheld_force(rehearsed: Path, tmp_path: Path) -> None:
    folder = tmp_path / "opened"
    shutil.copytree(rehearsed, folder)
    unblind(folder, "AB", "to see what was delivered")
    study = load_study(folder)
    rows = tracks(study)
    rows = rows[rows["block"] == "pairs"]
    assert sorted(rows["level"]) == [20, 80]
    assert (rows["level_delivered"] - rows["level"]).abs().max() < 1.5
    pairs, named_levels = level_results(study)
    withheld = pairs.statistics["withheld"]
    assert [(row["low"], row["n"]) for row in withheld] == [(20, 1), (80, 1)]
    assert all(0 <= row["mean_percent"] <= row["most_percent"] < 5 for row in withheld)
    assert not named_levels.statistics["withheld"]
    sections = ["".join(level_section(block, (), None)) for block in (pairs, named_levels)]
    assert ["Force held back by the safety layer" in section for section in sections] == [True, False]
    (block,) = (block for block in study.levels if block.id == "named")
    names = {setting.condition: setting_name(setting, block.settings) for setting in block.settings}
    assert names == {"water": "Water, force delayed by 15 ms, 20 % of force updates lost"}
