"""How fast trials follow each other in a long session: a rehearsal of 5,000 trials, the last 500 against the first 500.

``python tests/benchmarks/sessions/long_session.py [TRIALS]``, at least 200
"""

import string
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule
from study_app.session.resume import REHEARSED_SCREENS
from study_app.session.simulated.rehearsed_session import RehearsedSession, rehearsal_rig
from study_app.store.clock import SessionClock
from study_app.store.sessions.begin import SessionStart, begin

TRIALS = 5000
COMPARED = 500
REPETITIONS = 100  # in a block, which has two conditions
LIMIT = 1.5
ITEM = {"id": "strong", "text": "It is strong.", "short": "strong"}
BLOCK = {"title": "Block", "setting_label": "Setting", "task": "explore", "questionnaire": "feel", "part": 1}
STUDY = {
    "format": 1,
    "study": {"name": "long", "title": "Long", "version": "1", "languages": ["en"]},
    "device": {"workspace_mm": [100, 60, 60]},
    "liquids": {"thin": {"density_kg_m3": 1000}, "thick": {"density_kg_m3": 1450}},
    "conditions": {"thin": {"liquid": "thin"}, "thick": {"liquid": "thick"}},
    "tasks": {"explore": {"kind": "explore", "min_s": 0.5, "max_s": 1, "instruction": "Explore."}},
    "scales": {"judged": {"labels": {"en": [f"point {number}" for number in range(1, 8)]}}},
    "questionnaires": {"feel": {"intro": "How was it?", "scale": "judged", "items": [ITEM]}},
    "pages": {},
}


def main(trials: int = TRIALS) -> None:
    """Run the session and print how long a trial takes at its beginning and at its end."""
    letters = string.ascii_uppercase[: trials // (2 * REPETITIONS)]
    told = {**BLOCK, "conditions": ["thin", "thick"], "repetitions": REPETITIONS}
    blocks = {f"block_{letter.lower()}": {**told, "code_prefix": letter} for letter in letters}
    study = Protocol.model_validate({**STUDY, "blocks": blocks, "sequence": list(blocks)})
    ended_s = [time.perf_counter()]
    with tempfile.TemporaryDirectory() as folder, rehearsal_rig(study, "P001", 1, "scripted") as machine:
        store = begin(
            Path(folder) / "long",
            study,
            b"",
            SessionStart(
                "P001",
                seed=1,
                operator="",
                language="en",
                device=machine.described,
                screens=REHEARSED_SCREENS,
                simulated=True,
            ),
            clock=SessionClock(machine.servo.now_ns),
        )
        with store:
            schedule = build_schedule(study, "P001", 1)
            RehearsedSession(
                study, schedule, machine, store, felt=lambda _trial, _felt: ended_s.append(time.perf_counter())
            ).run()
    took_s = np.diff(ended_s)
    compared = min(COMPARED, trials // 4)
    first, last = (1 / took_s[1:][part].mean() for part in (slice(compared), slice(-compared, None)))
    print(f"{len(took_s)} trials: {first:.1f} a second among the first {compared}, {last:.1f} among the last;", end=" ")
    print(f"the last take {first / last:.2f} times as long (limit {LIMIT})")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
