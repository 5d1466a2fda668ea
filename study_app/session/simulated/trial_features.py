"""What each condition feels like: from a few whole sessions, rehearsed with hand, servo and screen and kept nowhere.

The force of an even motion could be had by arithmetic alone, but opinions rest on the wake's push, on how rough a force
is and how late the picture was, too. So the conditions are felt as a rehearsal feels them, and what was felt is used
again for answers without a servo and for power analysis.
"""

from collections.abc import Callable, Mapping
from typing import Final, TypeAlias

from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import Schedule, Trial, build_schedule, draw_key, stream
from study_app.protocol.simulated_observer import TrialFeatures
from study_app.protocol.streams import Key
from study_app.protocol.trials.presentation import next_level
from study_app.session.simulated.rehearsed_session import RehearsedSession, rehearsal_rig
from study_app.session.unkept import Unkept

Where: TypeAlias = tuple[str, str]
"""A block, whose task is done, and a condition."""

ConditionFeatures: TypeAlias = Mapping[Where, tuple[TrialFeatures, ...]]
"""What was felt in each trial of a condition in a block."""

REHEARSED_PEOPLE: Final = 4
"""So many simulated participants feel all conditions."""


def condition_features(
    protocol: Protocol, *, seed: int, people: int = REHEARSED_PEOPLE, progress: Callable[[str], object] | None = None
) -> ConditionFeatures:
    """Return what ``people`` simulated participants feel in every condition of the blocks.

    Raises
    ------
    DeviceError
        The simulated device cannot be opened.
    SessionError
        A session broke.
    """
    codes = draw_key(protocol, stream(seed, "blinding").random)
    key = Key(codes, b"what each condition feels like")
    found: dict[Where, list[TrialFeatures]] = {}
    for number in range(1, people + 1):
        person = f"P{number:03d}"
        schedule = build_schedule(protocol, person, seed)
        places = {trial.number: _presented(protocol, key, schedule, trial) for trial in schedule.trials}

        def feel(trial: int, felt: tuple[TrialFeatures, ...], places: Mapping[int, tuple[Where, ...]] = places) -> None:
            found.setdefault(places[trial][len(felt) - 1], []).append(felt[-1])

        with rehearsal_rig(protocol, person, seed, "scripted") as machine:
            RehearsedSession(
                protocol, schedule, machine, Unkept(machine.servo.now_ns, codes, key.secret), felt=feel
            ).run()
        if progress is not None:
            progress(f"{number} of {people} sessions simulated")
    return {where: tuple(felt) for where, felt in found.items()}


def _presented(protocol: Protocol, key: Key, schedule: Schedule, trial: Trial) -> tuple[Where, ...]:
    """Return what a trial presents, interval by interval; nothing where it is passed over with any answers."""
    if protocol.blocks[trial.block].design is None:
        return ((trial.block, key.codes[trial.block][trial.code]),)
    due = next_level(protocol, key, schedule, trial, ())
    return () if due is None else tuple((trial.block, one.condition) for one in due.intervals)
