"""What the pictures are taken of: a rehearsed study with one interrupted session, and a protocol of short tasks."""

import re
from pathlib import Path
from typing import Final

from study_app.protocol.load import load, source_bytes
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.blinded import blinding
from study_app.store.journals.journal_events import PageShown
from study_app.store.sessions.begin import SessionStart, begin_session
from study_app.store.unblinding import unblind

STUDY: Final = "rek2024"
WATCHED: Final = "watched"
"""Folder of a study whose trials are watched again."""
PARTICIPANTS: Final = 12
SEED: Final = 357711
QUICK: Final = (("min_s", "12"),)


def rehearsed(folder: Path) -> Path:
    """Rehearse the answers of a study, open its key, begin one session more; return the folder of results."""
    results = folder / "results"
    study = rehearse_answers(STUDY, participants=PARTICIPANTS, seed=SEED, results=results / STUDY)
    blinding.reveal(study, "AK", "to show what the windows look like")
    with begin_session(
        results / f"{STUDY}-pilot",
        load(STUDY),
        source_bytes(STUDY),
        SessionStart(
            "pilot1",
            seed=SEED,
            operator="AK",
            language="en",
            device={"name": "mouse"},
            screens={},
            simulated=False,
            pilot=True,
        ),
    ) as store:
        store.append(PageShown(page="consent"))
        store.close()
    return results


def recorded() -> None:
    """Rehearse a session of the demo with its recordings, and open its key."""
    unblind(rehearse("demo", participants=1, seed=SEED, results=Path(WATCHED, "demo")), "AK", "to watch it again")


def quick(folder: Path, *, blinding: str = "double") -> Path:
    """Write the study's protocol with short tasks into a folder of its own, and return its file."""
    text = source_bytes(STUDY).decode()
    for key, value in QUICK:
        text = re.sub(rf"^{key} = [\d.]+", f"{key} = {value}", text, flags=re.MULTILINE)
    if blinding != "double":
        text = text.replace("[study]\n", f'[study]\nblinding = "{blinding}"\n', 1)
    where = folder / blinding
    where.mkdir(parents=True, exist_ok=True)
    path = where / f"{STUDY}.toml"
    path.write_text(text, encoding="utf-8", newline="\n")
    return path
