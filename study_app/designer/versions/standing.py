"""Under which version a study may be saved, by what participants were run with."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from study_app.designer.document.toml_text import Refused
from study_app.number_text import counted
from study_app.store.study_runs import Run

_VERSION: Final = re.compile(r"[0-9A-Za-z.+-]+")


@dataclass(frozen=True, slots=True)
class Standing:
    """How a study's content stands to those that participants were run with.

    Attributes
    ----------
    version : str
        The version to save it as: its own, or the next free one.
    was : str
        The version that was run last; "" where none was.
    sessions : int
        How many sessions were run with this very content.
    asks : bool
        Whether saving asks first: the content differs from the one that was run.
    others : int
        How many sessions were run with the study's own version and another content.
    """

    version: str
    was: str = ""
    sessions: int = 0
    asks: bool = False
    others: int = 0


def standing(hash_: str, base: str, version: str, known: Iterable[Run]) -> Standing:
    """Return how a study's content stands to what was run; pilots and rehearsals protect nothing.

    Parameters
    ----------
    hash_ : str
        ``protocol_hash`` of the study as it is edited.
    base : str
        ``protocol_hash`` of the file that it is edited from; "" for a new study.
    version : str
        The version that the study states.
    known : iterable of Run
        What was run (`runs`).
    """
    ran = [run for run in known if run.sessions]
    if not ran:
        return Standing(version)
    same = sum(run.sessions for run in ran if run.hash == hash_)
    others = sum(run.sessions for run in ran if run.version == version and run.hash != hash_)
    asks = not same and bool(others or any(run.hash == base for run in ran))
    free = version
    while not same and any(run.version == free for run in ran):
        free = next_version(free)
    return Standing(free, ran[-1].version, same, asks, others)


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
        raise Refused(
            f"version {version} was run by {counted(others, 'session')} with another content: "
            f"save it as version {next_version(version)}"
        )


def check_version(version: str, known: Iterable[Run]) -> None:
    """Refuse what cannot be the version of a content that was not run.

    Raises
    ------
    Refused
        It is not letters, digits, dots, plus and minus, or participants were run with it.
    """
    if not _VERSION.fullmatch(version):
        raise Refused(f'"{version}" cannot be a version: write letters, digits, dots, plus and minus, such as 1.2')
    if any(run.sessions and run.version == version for run in known):
        raise Refused(f"version {version} was run with another content: choose another number")


def next_version(version: str) -> str:
    """Return a version with its last number raised: 1.2 of 1.1; of one without a number, with ".1" added."""
    last = re.search(r"(\d+)(\D*)$", version)
    if last is None:
        return f"{version}.1"
    return f"{version[: last.start()]}{int(last[1]) + 1}{last[2]}"
