"""Versions of a study: which were run with participants, what a change does to their data, what may be saved."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias

from study_app.authoring.writer.refused import Refused
from study_app.errors import StoreError
from study_app.protocol.differences import differences
from study_app.protocol.model import Protocol
from study_app.store import receipt
from study_app.store.folders import StudyFolder

Effect: TypeAlias = Literal["comparable", "measured", "tables"]
"""What a difference does: answers stay comparable, what is measured changes, or tables do not fit together."""

_TABLES: Final = re.compile(
    r"study\.name:"
    r"|questionnaires\.[^.:]+\.items\.[^.:]+: (new|gone)"
    r"|questionnaires\.[^.:]+\.items\.[^.:]+\.(kind|options\.[^.:]+)\b"
    r"|(questionnaires|blocks|pages|scales)\.[^.:]+: (new|gone)"
    r"|blocks\.[^.:]+\.code(_prefix|s)\b"
    r"|designs\.[^.:]+\.item:"
    r"|scales\.[^.:]+\.labels\.[^.:]+: \d+ entries"
)
_COMPARABLE: Final = re.compile(
    r"study\.(title|description|version|languages)\b"
    r"|pages\.[^.:]+\.(title|body|button)\b"
    r"|(blocks|questionnaires)\.[^.:]+\.(title|setting_label)\b"
    r"|questionnaires\.[^.:]+\.items\.[^.:]+\.short\b"
    r"|analysis\b"
)


@dataclass(frozen=True, slots=True)
class Run:
    """The sessions that were run with one content of a study's file, counted by what they were."""

    hash: str
    version: str
    sessions: int = 0
    pilots: int = 0
    rehearsals: int = 0
    last: str = ""
    protocol: Mapping[str, Any] | None = None


@dataclass(frozen=True, slots=True)
class Difference:
    """One difference from a version, in a sentence, and what it does."""

    sentence: str
    effect: Effect


def runs(results: Path, study: str) -> tuple[Run, ...]:
    """Return every content of a study that sessions were run with, the newest last.

    Nothing is read but receipts; no sealed key. A receipt that cannot be read is left out (`verify` reports it).

    Parameters
    ----------
    results : Path
        The folder with the studies' folders.
    study : str
        The study's name; its pilots and rehearsals are in folders of their own.
    """
    found: dict[str, Run] = {}
    folders = (results / study, results / f"{study}-pilot", *sorted(results.glob(f"{study}-rehearsal-*")))
    for folder in folders:
        for session in StudyFolder(folder).sessions():
            try:
                held = receipt.read(session.receipt)
            except StoreError:
                continue
            _count(found, held)
    return tuple(sorted(found.values(), key=lambda run: run.last))


def _count(found: dict[str, Run], held: Mapping[str, Any]) -> None:
    hash_, protocol = str(held.get("protocol_hash")), held.get("protocol", {})
    version = str(protocol.get("study", {}).get("version", ""))
    run = found.get(hash_, Run(hash_, version, protocol=protocol))
    kind = "rehearsals" if held.get("simulated") else "pilots" if held.get("pilot") else "sessions"
    last = max(run.last, str(held.get("started_at") or ""))
    counted = {kind: getattr(run, kind) + 1}
    found[hash_] = replace(run, last=last, **counted)


def changes(before: Protocol | Mapping[str, Any], after: Protocol) -> tuple[Difference, ...]:
    """Return how a study differs from a version, or from the protocol of a receipt, in the sentences of resuming."""
    return tuple(Difference(sentence, _effect(sentence)) for sentence in differences(before, after))


def _effect(sentence: str) -> Effect:
    if _TABLES.match(sentence):
        return "tables"
    return "comparable" if _COMPARABLE.match(sentence) else "measured"


def check_saving(hash_: str, version: str, known: tuple[Run, ...]) -> None:
    """Refuse to save a version under the number of another content that participants were run with.

    Parameters
    ----------
    hash_, version : str
        ``protocol_hash`` and version of what is to be saved.
    known : tuple of Run
        What was run (`runs`); pilots and rehearsals protect nothing.

    Raises
    ------
    Refused
        The version was run with another content.
    """
    others = sum(run.sessions for run in known if run.version == version and run.hash != hash_)
    if others:
        counted = f"{others} session{'s' * (others > 1)}"
        raise Refused(
            f"version {version} was run by {counted} with another content: save it as version {next_version(version)}"
        )


def next_version(version: str) -> str:
    """Return a version with its last number raised: 1.2 of 1.1; of one without a number, with ".1" added."""
    last = re.search(r"(\d+)(\D*)$", version)
    if last is None:
        return f"{version}.1"
    return f"{version[: last.start()]}{int(last[1]) + 1}{last[2]}"
