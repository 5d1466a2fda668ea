"""Studies that several tests read: made once, or small, with journals, receipts and a sealed key but no servo."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest

from study_app.protocol.load import load
from study_app.protocol.model import Protocol
from study_app.protocol.simulated import TrialFeatures
from study_app.protocol.source.files import source_bytes
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.session.simulated.rehearsal import ConditionFeatures
from study_app.store.journals.journal import SessionClock
from study_app.store.sessions.begin import SessionStart, begin_session
from study_app.store.sessions.open_session import SessionStore


def once(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], object]) -> Path:
    """Return the folder that ``make`` filled once for all workers of a run; copy it before changing it."""
    own = factory.getbasetemp()
    folder = (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / f"once-{name}"
    if not folder.exists():
        making = factory.mktemp(name)
        make(making)
        with suppress(OSError):  # another worker was first
            making.rename(folder)
    return folder


def begun(
    folder: Path,
    participant: str = "P001",
    study: Protocol | Path | str = "demo",
    source: bytes = b"",
    *,
    clock: SessionClock | None = None,
    **start_values: Any,
) -> SessionStore:
    """Begin a session in a study's folder; any value of its ``SessionStart`` can be given."""
    values: dict[str, Any] = {"seed": 1, "operator": "", "language": "en", "device": {"name": "mouse"}, "screens": {}}
    start = SessionStart(participant, **(values | {"simulated": False} | start_values))
    if isinstance(study, Protocol):
        return begin_session(folder, study, source, start, clock=clock)
    return begin_session(folder, load(study), source_bytes(study), start, clock=clock)


@contextmanager
def quick_pdfs() -> Iterator[None]:
    """Embed the fonts of PDF figures as type 3: choosing their glyphs for type 42 takes a fifth of a report."""
    from study_app import figure_style  # not installed wherever sessions run

    with pytest.MonkeyPatch.context() as patched:
        patched.setitem(figure_style.SETTINGS, "pdf.fonttype", 3)
        yield


def made_up(name: str | Path) -> ConditionFeatures:
    """Return made-up features of every condition of a study, which differ only in force and delay."""
    study = load(name)
    return {
        (block.id, condition): (
            TrialFeatures(
                force_mean_n=0.5 + 0.4 * number,
                force_peak_n=4.0,
                speed_rms_mps=0.1,
                push_share=0.02,
                roughness_n=0.03,
                delay_s=study.delay_s(condition),
            ),
        )
        for block in study.blocks.values()
        for number, condition in enumerate(block.conditions)
    }


def rehearsed(results: Path, name: str = "demo", *, people: int = 3) -> Path:
    """Rehearse answers of a study under a results folder; return the study's folder."""
    return rehearse_answers(name, participants=people, seed=1, results=results / name, features=made_up(name))
