"""What each condition feels like: from a few whole sessions, rehearsed with hand, servo and screen and kept nowhere.

The force of an even motion could be had by arithmetic alone, but opinions rest on the wake's push, on how rough a force
is and how late the picture was, too. So the conditions are felt as a rehearsal feels them, and what was felt is used
again for answers without a servo and for power analysis.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final, TypeAlias

from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule, draw_key, stream
from study_app.protocol.questions.simulated_answers import Felt
from study_app.session.simulated.rehearsal import Machine, Rehearsal
from study_app.session.unkept import Unkept

Where: TypeAlias = tuple[str, str]
"""A block, whose task is done, and a condition."""

Feelings: TypeAlias = Mapping[Where, tuple[Felt, ...]]
"""What was felt in each trial of a condition in a block."""

FEELING: Final = 4
"""So many simulated participants feel all conditions."""


def feelings(
    protocol: Protocol, *, seed: int, people: int = FEELING, progress: Callable[[str], object] | None = None
) -> Feelings:
    """Return what ``people`` simulated participants feel in every condition of the blocks.

    Raises
    ------
    DeviceError
        The simulated device cannot be opened.
    SessionError
        A session broke.
    """
    codes = draw_key(protocol, stream(seed, "blinding").random)
    found: dict[Where, list[Felt]] = {}
    for number in range(1, people + 1):
        person = f"P{number:03d}"
        schedule = build_schedule(protocol, person, seed)
        places = {trial.number: (trial.block, codes[trial.block][trial.code]) for trial in schedule.trials}

        def feel(trial: int, felt: Felt, places: Mapping[int, Where] = places) -> None:
            found.setdefault(places[trial], []).append(felt)

        with Machine(protocol, person, seed, "scripted") as machine:
            Rehearsal(protocol, schedule, machine, Unkept(machine.servo.now_ns, codes), felt=feel).run()
        if progress is not None:
            progress(f"{number} of {people} sessions felt")
    return {where: tuple(felt) for where, felt in found.items()}
