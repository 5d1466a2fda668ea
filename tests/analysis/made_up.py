"""Studies made up in memory: one block with any settings, people, sessions, repetitions and answers."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd

from study_app.analysis.data.blocks import NOTHING_DECIDED, Block, Decided, Item, Setting
from study_app.analysis.data.study_tables import Study
from study_app.store.files.columns import RESPONSES, TRIALS
from study_app.store.files.csv_files import Column

TYPES = {"text": "string", "time": "string", "integer": "Int64", "number": "Float64", "flag": "boolean"}
ITEMS = ("different", "harder")
DECIDED = replace(
    NOTHING_DECIDED, made=True, equivalence_bound=1.0, rising=ITEMS[:1], falling=ITEMS[1:], noticed=ITEMS[0], names=()
)

Presented = tuple[str, int, str, Sequence[int | None]]
"""A trial: participant, session, code, and the answers to the items."""


def delays(delays_ms: Sequence[float]) -> tuple[Setting, ...]:
    """Return settings D1, D2 … of one liquid in the order of a study."""
    settings = [
        Setting(code=f"D{place}", condition=f"delay_{place}", liquid="water", delay_ms=float(ms))
        for place, ms in enumerate(delays_ms, start=1)
    ]
    return tuple(sorted(settings, key=lambda setting: setting.delay_ms or 0.0))


def liquids(count: int) -> tuple[Setting, ...]:
    """Return settings of so many liquids, L1, L2 …, the first two of which the first two items name."""
    names = [*ITEMS, *[None] * count]
    return tuple(
        Setting(code=f"L{place}", condition=f"c{place}", liquid=f"liquid{place}", delay_ms=0.0, label=names[place - 1])
        for place in range(1, count + 1)
    )


def study(settings: Sequence[Setting], trials: Sequence[Presented], decided: Decided = DECIDED) -> Study:
    """Return a study with one block."""
    kind = "delays" if settings[0].code.startswith("D") else "liquids"
    if kind == "liquids":
        decided = replace(decided, names=ITEMS)
    items = tuple(Item(id=item, text=item, short=item.capitalize()) for item in ITEMS)
    block = Block(
        id="b",
        title="Block",
        kind=kind,
        settings=tuple(settings),
        items=items,
        labels=tuple("1234567"),
        cannot_judge=None,
    )
    presented, answers = [], []
    for number, (participant, session, code, trial_answers) in enumerate(trials, start=1):
        place = {
            "study": "made_up",
            "participant": participant,
            "session": session,
            "simulated": True,
            "pilot": False,
            "trial": number,
            "attempt": 1,
            "block": "b",
            "phase": "main",
            "index": number,
            "of": len(trials),
            "code": code,
        }
        presented.append(place)
        answers += [
            {**place, "item": item, "response": value, "cannot_judge": False}
            for item, value in zip(ITEMS, trial_answers, strict=True)
        ]
    given_answers = table(RESPONSES, answers)
    visits = sorted({(participant, session) for participant, session, _, _ in trials})
    return Study(
        folder=Path("nowhere"),
        name="made_up",
        title="Made up",
        version="1",
        blocks=(block,),
        settings={("b", setting.code): setting for setting in settings},
        responses=given_answers,
        answered=given_answers,
        trials=table(TRIALS, presented),
        participants=pd.DataFrame([_visit(*visit) for visit in visits], columns=list(_visit("", 1))),
        exclusions=(),
        decided=decided,
        protocol={"blocks": {"b": {"order": "shuffled", "task": "explore"}}, "tasks": {"explore": {"kind": "explore"}}},
    )


def table(columns: Sequence[Column], rows: Sequence[dict[str, Any]]) -> pd.DataFrame:
    """Return a data frame with all columns of a table; absent values are missing and every row counts."""
    arrays = {
        column.name: pd.array([row.get(column.name) for row in rows], dtype=TYPES[column.kind])  # type: ignore[call-overload]
        for column in columns
    }
    status = pd.array(["completed"] * len(rows), dtype="string")
    return pd.DataFrame(arrays).assign(session_status=status, excluded=False, exclusion_reason=None, counted=True)


def _visit(participant: str, session: int) -> dict[str, Any]:
    unknown = (
        "language",
        "ended_at",
        "device",
        "key_hash",
        "seed",
        "protocol_hash",
        "version",
        "exclusion_reason",
        "missing",
        "group",
    )
    return {
        **dict.fromkeys((*unknown, "motors_masked", "missing")),
        "started_at": f"2026-01-{session:02d}",
        "participant": participant,
        "session": session,
        "simulated": True,
        "pilot": False,
        "status": "completed",
        "protocol_version": "1",
        "counted": True,
        "excluded": False,
    }


def everybody(
    settings: Sequence[Setting], people: int, answer: Any, *, sessions: int = 1, repetitions: int = 1
) -> Iterator[Presented]:
    """Yield the trials in which ``answer(person, session, code, item)`` is answered, every setting to everybody."""
    for person in range(people):
        for session in range(1, sessions + 1):
            for _ in range(repetitions):
                for setting in settings:
                    answers = [answer(person, session, setting.code, item) for item in ITEMS]
                    yield f"P{person:03d}", session, setting.code, answers
