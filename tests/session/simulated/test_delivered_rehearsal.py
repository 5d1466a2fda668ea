"""What check passes at its very limits is delivered as requested, and never clipped, on the paced scripted hand."""

from pathlib import Path

import pytest

from study_app.session.replay import replay
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.blinded.blinding import open_events, read_key
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal
from tests.compiled import needs_servo
from tests.journal_lines import raw
from tests.protocol.edited_studies import text_of

pytestmark = needs_servo


@pytest.mark.parametrize("study", ["dampers", "oils", "delays"])
@pytest.mark.slow
def test_every_interval_is_delivered_as_requested(tmp_path: Path, study: str) -> None:
    path = tmp_path / "limits.toml"
    path.write_text(text_of(f"limits_{study}"), encoding="utf-8", newline="\n")
    results = rehearse(path, participants=1, seed=1, results=tmp_path / "results")
    session = StudyFolder(results).sessions()[0]
    lines = raw(open_events(journal.read(session.journal), read_key(results)))
    intervals = [line for line in lines if line["event"] == "interval_ended"]
    assert intervals
    for line in intervals:
        assert "invalid" not in line
        assert line["limiter_norm"] == 0
        assert line["force_share"] == pytest.approx(1.0, abs=0.02)
        assert 0.0888 * 0.6 < line["pace_mps"] < 0.0888 * 1.4
        assert (line["value_delivered"] is None) == (study == "delays")
    assert {line["outcome"] for line in lines if line["event"] == "trial_ended"} == {"complete"}
    assert replay(session.path).proved
