"""Parsing of JSON, and of names in it, in files that users may have changed."""

import json
import re
from collections.abc import Iterable
from typing import Any

STUDY_NAME = re.compile(r"[a-z][a-z0-9]{0,39}")  # as in a protocol
PARTICIPANT_ID = re.compile(r"[A-Za-z0-9]{1,32}")
RECORDING_NAME = re.compile(r"recordings/trial-[0-9]{3,}(_attempt-[0-9]+)?(_interval-[0-9]+)?(_frames)?\.parquet")

_MOST_LEVELS = 64  # so that code may process a value recursively
_TOO_DEEP = "it is nested too deeply"


def check_study_name(name: object) -> str:
    """Return the name of a study in a file of the results, if a protocol can have it.

    Raises
    ------
    ValueError
        No protocol has such a name, and no file may be called by it.
    """
    if not isinstance(name, str) or not STUDY_NAME.fullmatch(name):
        raise ValueError("no study has this name")
    return name


def parse_json(content: bytes | str) -> Any:
    """Return the value in ``content``.

    Raises
    ------
    ValueError
        It is not JSON, which excludes NaN and Infinity, or is nested too deeply.
    """
    try:
        value = json.loads(content, parse_constant=_refuse)
    except RecursionError as error:
        raise ValueError(_TOO_DEEP) from error
    level = [value]
    for _ in range(_MOST_LEVELS):
        level = [inner for outer in level if isinstance(outer, dict | list) for inner in _within(outer)]
        if not level:
            return value
    raise ValueError(_TOO_DEEP)


def _within(value: dict[str, Any] | list[Any]) -> Iterable[Any]:
    return value.values() if isinstance(value, dict) else value


def _refuse(constant: str) -> None:
    raise ValueError(f"{constant} is not JSON")
