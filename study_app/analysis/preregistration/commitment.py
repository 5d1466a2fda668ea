"""The part of a preregistration that the report compares with: hash, participants, precision and exclusion rules."""

import json
import re
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from study_app.errors import AnalysisError
from study_app.protocol.model import Protocol
from study_app.store.atomic import parse_json

FILE: Final = "preregistration.md"
"""Its name in a study's folder."""
CATCH: Final = "catch"
"""The rule of exclusion that `unblind` applies."""
_BLOCK: Final = re.compile(r"^```json\n(\{.*?\})\n```$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True, slots=True)
class Commitment:
    """What was committed to.

    Attributes
    ----------
    participants : int or None
        How many are planned.
    precision : float or None
        Half the 95 % interval of the group's mean that is planned, as a share of the mean.
    rules : tuple of str
        Names of the rules that exclude sessions.
    """

    study: str
    version: str
    protocol_hash: str
    participants: int | None
    precision: float | None
    rules: tuple[str, ...]


def commitment(protocol: Protocol, protocol_hash: str) -> Commitment:
    """Return what a protocol commits to."""
    decided = protocol.analysis
    return Commitment(
        protocol.study.name,
        protocol.study.version,
        protocol_hash,
        None if decided is None else decided.participants,
        None if decided is None else decided.precision,
        (CATCH,) if any(block.catch is not None for block in protocol.main_blocks) else (),
    )


def written(one: Commitment) -> str:
    """Return it as the last lines of a preregistration."""
    return f"```json\n{json.dumps(asdict(one), indent=1)}\n```\n"


def read(folder: Path) -> Commitment | None:
    """Return what the preregistration in a study's folder commits to; None: there is none.

    Raises
    ------
    AnalysisError
        It cannot be read.
    """
    path = folder / FILE
    try:
        found = _BLOCK.findall(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except (OSError, UnicodeDecodeError) as error:
        raise AnalysisError(f"{path} cannot be read ({error}): restore it from a copy") from error
    try:
        values: dict[str, Any] = parse_json(found[-1])
        one = Commitment(**{**values, "rules": tuple(values["rules"])})
        _check_types(one)
    except (IndexError, KeyError, TypeError, ValueError) as error:
        raise AnalysisError(
            f"{path} does not end with what `liquid-study preregister` writes there ({type(error).__name__}): restore "
            "it from a copy, or remove it"
        ) from error
    return one


def _check_types(one: Commitment) -> None:
    """Refuse what `written` never writes (TypeError)."""
    texts = all(isinstance(text, str) for text in (one.study, one.version, one.protocol_hash, *one.rules))
    if not (texts and isinstance(one.participants, int | None) and isinstance(one.precision, int | float | None)):
        raise TypeError("values of other types")
