"""Data are the same in every time zone and default locale."""

import re
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import QLocale

from study_app.analysis.export_study import export
from study_app.analysis.report.write_report import report
from study_app.gui.sessions.session_page import read_record
from study_app.store.files.folders import StudyFolder
from study_app.store.unblinding import unblind
from study_app.store.verification.whole_study import verify_study
from tests.studies import rehearsed

pytestmark = [
    pytest.mark.slow,
    pytest.mark.usefixtures("quick_pdf"),
    pytest.mark.skipif(not hasattr(time, "tzset"), reason="this system sets no time zone for one process"),
]


@pytest.fixture
def travel(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str], None]]:
    """Switch to a time zone."""

    def go(zone: str) -> None:
        monkeypatch.setenv("TZ", zone)
        time.tzset()

    yield go
    monkeypatch.undo()
    time.tzset()


@pytest.fixture
def german() -> Iterator[None]:
    """Switch to a locale with decimal commas."""
    before = QLocale()
    QLocale.setDefault(QLocale("de_DE"))
    yield
    QLocale.setDefault(before)


@pytest.mark.usefixtures("german")
def test_data_are_the_same_in_every_time_zone(tmp_path: Path, travel: Callable[[str], None]) -> None:
    travel("LINT-14")  # Kiritimati
    study = rehearsed(tmp_path)
    travel("NST3:30NDT")  # Newfoundland, where it is the day before
    assert verify_study(study).errors == ()
    unblind(study, "AB", "elsewhere")
    written = {}
    for zone in ("NST3:30NDT", "NPT-5:45"):
        travel(zone)
        assert verify_study(study).errors == ()
        to = tmp_path / zone[:3]
        export(study, to, extras=["wide"])
        report(study, to)
        written[zone] = {path.name: path.read_bytes() for path in to.iterdir() if path.suffix == ".csv"}
    first, second = written.values()
    assert first == second
    assert len(first) > 4
    session, *_ = (place.path for place in StudyFolder(study).sessions())
    about = {}
    for zone in ("LINT-14", "NPT-5:45"):
        travel(zone)
        (about[zone],) = re.findall(r"ended (\d\d):(\d\d)", read_record(session).about)
    there, here = (60 * int(hours) + int(minutes) for hours, minutes in about.values())
    assert (there - here) % 1440 == 14 * 60 - (5 * 60 + 45)
    assert re.search(rb",\d+\.\d+,", first["study-demo_description-trials_data.csv"])
