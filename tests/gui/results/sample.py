"""Values that the results window is tested with."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from study_app.analysis.worker_messages import FigureDrawn, StudyAt
from study_app.gui.results.figures import ResultsView
from study_app.gui.sessions.session_facts import SessionFacts
from study_app.store.exclusions import Exclusion

COLOURS = {"text": "#13202c", "accent": "#0b65a3", "grid": "#e6ebef", "band": "#c8dded"}
SVG = b"""<?xml version="1.0"?>
<svg xmlns="http://www.w3.org/2000/svg" width="200pt" height="100pt" viewBox="0 0 200 100" version="1.1">
<path d="M 0 0 L 200 0 L 200 100 L 0 100 z" id="paper" style="fill: #ffffff"/>
<path d="M 0 20 L 200 20" style="fill: none; stroke: #e6ebef"/>
<path d="M 0 30 L 200 30" style="fill: none; stroke: #0b65a3"/>
<path d="M 50 40 L 150 40 L 150 60 L 50 60 z" id="level7" style="fill: #02256d; stroke: #ffffff"/>
<path d="M 50 70 L 150 70 L 150 90 L 50 90 z" id="shade" style="fill: #0b65a3; fill-opacity: 0.3"/>
<text x="60" y="55" style="font-family: 'Inter', 'DejaVu Sans', sans-serif; fill: #ffffff" id="white">7</text>
<text x="5" y="15" style="font-family: 'Inter', 'DejaVu Sans', sans-serif; fill: #13202c" id="ink">A</text>
</svg>
"""
STUDY = Path("results/rek2024")


def facts(participant: str, **changes: Any) -> SessionFacts:
    held: dict[str, Any] = {
        "participant": participant,
        "session": 1,
        "study": "rek2024",
        "started": datetime(2026, 11, 18, 9, 30, tzinfo=UTC),
        "status": "completed",
        "validity": "valid",
        "answers": 62,
        "answers_of": None,
        "simulated": True,
        "pilot": False,
        "folder": STUDY / participant,
        "excluded": None,
    }
    return SessionFacts(**(held | changes))


def view(**changes: Any) -> ResultsView:
    people = [facts("P007", status="unfinished", validity=None), *(facts(f"P{number:03d}") for number in range(1, 7))]
    held: dict[str, Any] = {
        "studies": (StudyAt(STUDY, True, False, 2.0), StudyAt(Path("results/demo"), False, False, 1.0)),
        "chosen": STUDY,
        "sessions": tuple(people),
        "sealed": True,
        "trials": {("P001", 1): ((2, "Part 1, L2"), (3, "Part 1, L1"))},
        "figures": (
            FigureDrawn(
                name="liquids", title="Agreement for each setting", caption="Agreement with nine statements.", svg=SVG
            ),
            FigureDrawn(
                name="delays",
                title="Answers for each delay setting",
                caption="Agreement with five statements.",
                svg=SVG,
            ),
        ),
        "colours": COLOURS,
        "exclusions_file": STUDY / "exclusions.csv",
    }
    return ResultsView(**(held | changes))


LEFT_OUT = Exclusion(
    participant="P003",
    session=1,
    trial=4,
    rule_or_person="AK",
    reason="phone rang",
    excluded_at="2026-11-19T00:00:00+00:00",
)
