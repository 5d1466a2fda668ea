"""The marker stream of a session tells no condition, liquid, parameter or delay."""

import json
import re
from pathlib import Path

import pytest

from study_app.protocol.load import load
from study_app.protocol.source.files import source_bytes
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.verification.leaks import telltales
from tests.compiled import needs_servo
from tests.journal_lines import raw
from tests.outlets.collector import Collector, collecting

pytestmark = [pytest.mark.slow, needs_servo]

COUNTS = ("t_s", "trial", "attempt", "target", "trigger")
NAMED = (
    (r'\["thin", "thick"\]', '["feel_quagmire", "feel_mildew"]'),
    (r"conditions\.thin\b", "conditions.feel_quagmire"),
    (r"conditions\.thick\b", "conditions.feel_mildew"),
    (r"^delay_ms = 200\b", "delay_ms = 137.31"),
    (r"^min_s = [\d.]+", "min_s = 2"),
    (r"^count = [\d.]+", "count = 2"),
)


@pytest.fixture(scope="module")
def protocol(tmp_path_factory: pytest.TempPathFactory) -> Path:
    text = source_bytes("demo").decode()
    for pattern, word in NAMED:
        text, count = re.subn(pattern, word, text, flags=re.MULTILINE)
        assert count, pattern
    path = tmp_path_factory.mktemp("named") / "named.toml"
    path.write_text(text, encoding="utf-8", newline="\n")
    return path


@pytest.fixture(scope="module")
def rehearsed(protocol: Path) -> tuple[Path, Collector]:
    with collecting() as collector:
        return rehearse(protocol, participants=1, seed=5, results=protocol.parent / "results"), collector


def words_found(collector: Collector, protocol: Path) -> list[str]:
    """Return the words of the protocol's conditions in the markers, but for moments and counts."""
    words = telltales(load(str(protocol)))
    marker_fields = [json.loads(marker.text) for marker in collector.markers]
    return [word for fields in marker_fields for word in words.in_text(json.dumps(fields | dict.fromkeys(COUNTS)))]


def test_markers_are_the_journals_events_with_their_codes(rehearsed: tuple[Path, Collector]) -> None:
    folder, collector = rehearsed
    (session,) = StudyFolder(folder).sessions()
    lines = raw(journal.read(session.journal))
    marked = [line for line in lines if line["event"] not in {"recorded", "preflight"}]
    assert "target_reached" in collector.events
    journalled = [marker for marker in collector.markers if marker.event != "target_reached"]
    assert [marker.event for marker in journalled] == [line["event"] for line in marked]
    assert {"trial_started", "trial_ended", "choice", "responses"} < set(collector.events)
    for marker, line in zip(journalled, marked, strict=True):
        content = json.loads(marker.text)
        assert content["t_s"] == line["t_s"]
        assert content.get("code") == line.get("code")
    assert not any("sealed" in marker.text or "value" in marker.text for marker in collector.markers)


def test_markers_do_not_reveal_a_condition(rehearsed: tuple[Path, Collector], protocol: Path) -> None:
    assert words_found(rehearsed[1], protocol) == []
