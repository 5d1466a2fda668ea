"""Ids, and short names of studies: made from a text, and free among those that are taken."""

import re
import unicodedata
from collections.abc import Iterable
from itertools import count
from typing import Final

MAX_ID: Final = 60
"""Letters of a name that tables and windows can show whole."""
MAX_SHORT_NAME: Final = 40
_MONTHS: Final = (
    "jan(uar[iy]?|v(ier)?)?|feb(ruar[iy]?)?|fevr?(ier)?|mar(ch|s)?|mrz|mrt|maart|apr(il)?|avr(il)?|may|mai|mei|jun[ei]?|"
    "juin|jul[iy]?|juil(let)?|aug(ust(us)?)?|aout|sept?(ember|embre)?|o[ck]t(ober|obre)?|nov(ember|embre)?|"
    "de[cz](ember|embre)?"
)
_READ_AS: Final = {
    "a missing value": "na|nan|none|null|nil",
    "true or false": "t|f|true|false|wahr|falsch|vrai|faux|waar|onwaar",
    "a number": r"0[0-9]+|[0-9]{16,}|[0-9]+(e[0-9]*|d[0-9]+|i)|0x[0-9a-f]+(p[0-9]+)?|inf|infinity",
    "a date or a time": rf"({_MONTHS})[0-9]{{1,4}}|[0-9]{{1,4}}({_MONTHS})[0-9]{{0,4}}|[0-9]{{1,2}}[ap]m",
}
"""What spreadsheets, R, pandas and SPSS make of a text of letters and digits, in any case."""
MAX_FROM_TEXT: Final = 24
"""So many letters of a sentence make an id: it heads a column of tables."""
_ANY_LENGTH: Final = 10_000


_RESERVED: Final = re.compile(r"(con|prn|aux|nul|com[1-9]|lpt[1-9]) *(\..*)?", re.IGNORECASE | re.DOTALL)
_RESERVED_NAMES: Final = {"con", "prn", "aux", "nul", *(f"{port}{n}" for port in ("com", "lpt") for n in range(1, 10))}


def file_name_fault(name: str) -> str:
    """Return why Windows cannot have a file or folder with this name, "" if it can: studies are shared.

    Examples
    --------
    >>> [file_name_fault(name) for name in ("con", "aux.toml", "waves.", "why?.mp4", "control")]
    ['is reserved for a device on Windows', 'is reserved for a device on Windows', 'ends with "."', 'contains "?"', '']
    """
    if _RESERVED.fullmatch(name):
        return "is reserved for a device on Windows"
    if name.endswith((".", " ")) and name not in {".", ".."}:
        return f'ends with "{name[-1]}"'
    letter = next((letter for letter in name if letter in '<>:"|?*'), "")
    return f'contains "{letter}"' if letter else ""


def read_as(text: str) -> str:
    """Return the type as which other programs read a participant's id, such as "a number" for "007", or "".

    Examples
    --------
    >>> [read_as(text) for text in ("P007", "12", "007", "1E5", "NA", "MAR1")]
    ['', '', 'a number', 'a number', 'a missing value', 'a date or a time']
    """
    return next((what for what, pattern in _READ_AS.items() if re.fullmatch(pattern, text, re.IGNORECASE)), "")


def id_of(text: str, longest: int = MAX_ID) -> str:
    """Return the id made from a text: its words in lower case without accents, as many as fit.

    Its first word begins with a letter; "" if there is none.

    Examples
    --------
    >>> id_of("2. How thick was it?")
    'how_thick_was_it'
    """
    plain = unicodedata.normalize("NFKD", re.sub("['’]", "", text.casefold()))
    plain = "".join(letter for letter in plain if not unicodedata.combining(letter))
    name = re.sub("[^a-z0-9]+", "_", plain).lstrip("0123456789_").rstrip("_")
    whole, _, _ = name[: longest + 1].rpartition("_")
    return name if len(name) <= longest else whole or name[:longest]


def free_id(taken: Iterable[str], name: str) -> str:
    """Return ``name``, or the name with the first free number from 2, which replaces a number at its end."""
    return _free(taken, name, re.sub(r"_[0-9]+$", "", name), "_", MAX_ID)


def short_name_of(text: str) -> str:
    """Return the short name of a study made from a text: the letters a to z and digits of its id."""
    return id_of(text, _ANY_LENGTH).replace("_", "")[:MAX_SHORT_NAME]


def free_short_name(taken: Iterable[str], name: str) -> str:
    """Return a free short name of a study, like `free_id`: "kitchen2"; a year is kept: "rek2024v2"."""
    stem = re.sub("(?<=[0-9])v[0-9]+$|(?<=[a-z])[0-9]{1,2}$", "", name)
    return _free({*taken, *_RESERVED_NAMES}, name, stem, "v" if stem[-1:].isdigit() else "", MAX_SHORT_NAME)


def _free(taken: Iterable[str], name: str, stem: str, mark: str, longest: int) -> str:
    used = set(taken)
    ends = (f"{mark}{number}" for number in count(2))
    names = (f"{stem[: longest - len(end)]}{end}" for end in ends)
    return name if name not in used else next(new for new in names if new not in used)
