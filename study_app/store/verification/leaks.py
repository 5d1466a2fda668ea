"""Search for words that reveal a condition, which shows that blinding is intact.

A condition is revealed by its id, its liquid's id, the liquid's parameters and its delay, a trial with a design also by
its level, standard and comparison. None of these words may occur in the contents or names of a study folder's files.
Exempt are the sealed key, the preregistration (which contains no codes), the statements (whose words are shown to the
participant anyway), the times of events, and the recordings (which contain measured forces and frame ages).
"""

import csv
import io
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import zip_longest
from pathlib import Path
from typing import Any, TypeAlias

from study_app.protocol.model import Protocol
from study_app.store.files.atomic import cannot_read, parse_json, paths_in
from study_app.store.files.columns import every_column
from study_app.store.files.csv_files import MISSING
from study_app.store.files.folders import StudyFolder
from study_app.store.journals.journal_events import Event, Stepped, TrialStarted

Tables: TypeAlias = Mapping[str, Any]

_STATEMENTS = frozenset({"item", "items"})  # names of free texts in journal, receipt and tables
_TIMES = frozenset({"t_s", "onset_s", "first_choice_s", "last_change_s", "trial_started_s"})
_IGNORED_NAMES = _STATEMENTS | _TIMES  # a time may equal a parameter by chance: 1.717 s and 1717 ticks
_HARMLESS_NAMES = frozenset(
    {"id", "effects", "kind", "axes"}
)  # words of the force model that do not reveal a condition by themselves
_COMMON_VALUES = (MISSING, "true", "false", "none")  # values in the files of any study
_MIN_CERTAIN_DIGITS = 5  # number of digits that are unlikely to occur by chance


@dataclass(frozen=True, slots=True)
class Leak:
    """A word that reveals a condition, with its file and line; the word must not be shown."""

    place: str
    word: str = field(repr=False)


class Telltales:
    """Words that reveal conditions, from `telltales` or `certain_telltales`."""

    def __init__(self, words: Iterable[str]) -> None:
        self.words = frozenset(words)
        longest_first = sorted(self.words, key=lambda word: (-len(word), word))
        alternatives = "|".join(re.escape(word) for word in longest_first)
        self._pattern = re.compile(rf"(?<!\w)(?<!\d\.)(?:{alternatives})(?!\w|\.\d)" if alternatives else r"(?!)")

    def in_text(self, text: str) -> list[str]:
        """Return the revealing words that occur as whole words in ``text``: a window's title, a log line, a cell."""
        return self._pattern.findall(text)


def telltales(protocol: Protocol, recorded: Iterable[float] = ()) -> Telltales:
    """Return the words that reveal a condition or level of ``protocol``: ids, and numbers in every unit in use.

    ``recorded`` are further numbers, from `recorded_numbers`.
    """
    terms = _revealing_words(protocol.model_dump(mode="json", include={"liquids", "conditions"}, exclude_unset=True))
    return Telltales(terms | _all_notations({*presented_numbers(protocol), *recorded}))


def presented_numbers(protocol: Protocol) -> frozenset[float]:
    """Return every level, standard and comparison that trials of a protocol can present, except 0."""
    numbers: set[float] = set()
    for block in protocol.blocks.values():
        if block.design is None or block.stimulus is None:
            continue
        stimulus, method = protocol.stimulus_of(block), protocol.method_of(block)
        levels = {*method.levels_of(stimulus)}
        first = protocol.design_of(block).first
        levels |= {stimulus.levels[1]} if block.catch is not None else set()
        levels |= set() if first is None else {first.level}
        standards = protocol.standards_of(block)
        numbers |= levels | {standard for standard in standards if standard is not None}
        numbers |= {stimulus.comparison(standard, level) for standard in standards for level in levels}
    return frozenset(numbers - {0.0})


def recorded_numbers(protocol: Protocol, opened: Iterable[Event]) -> frozenset[float]:
    """Return every level and comparison presented according to the opened lines of a journal.

    Methods may choose any level; levels that a participant set step by step are included.
    """
    numbers: set[float] = set()
    setting, position = None, 0
    for line in opened:
        if isinstance(line, TrialStarted) and line.level:
            block, standard = protocol.blocks[line.block], line.standard
            numbers |= {line.level, protocol.stimulus_of(block).comparison(standard, line.level)}
            setting, position = protocol.adjusting(block, standard, line.level), 0
        elif isinstance(line, Stepped) and setting is not None:
            position = setting.moved(position, line.steps)
            numbers |= {setting.level(position), setting.comparison(position)}
    return frozenset(numbers - {0.0})


def certain_telltales(tables: Tables, published: Any, levels: Iterable[float] = ()) -> Telltales:
    """Return the words that reveal a condition and are unlikely to occur by chance.

    Short numbers, words of the ``published`` protocol and words in the files of any study are left out. ``tables`` are
    those of the sealed key, ``published`` is the receipt's protocol, ``levels`` are `presented_numbers`.
    """
    columns = [column.variable for column in every_column(intervals=True)]
    harmless_text = " ".join(text for _, text in _texts([published, columns, _COMMON_VALUES], "", frozenset()))
    words = _revealing_words(tables) | _all_notations(levels)
    certain = (
        word for word in words if not word.lstrip("-")[:1].isdigit() or _count_digits(word) >= _MIN_CERTAIN_DIGITS
    )
    return Telltales(word for word in certain if not Telltales([word]).in_text(harmless_text))


def find_leaks(folder: Path, telling: Telltales) -> list[Leak]:
    """Return the ``telling`` words in names and texts of ``folder``, except where they are permitted (see above)."""
    leaks: list[Leak] = []
    study = StudyFolder(folder)
    for path in paths_in(folder):
        name = path.relative_to(folder).as_posix()
        leaks += [Leak(f"the name {name}", word) for word in telling.in_text(name)]
        if path.is_file() and path not in (study.key, study.preregistration) and path.suffix != ".parquet":
            leaks += _find_in_file(path, name, telling)
    return leaks


def _find_in_file(path: Path, name: str, telling: Telltales) -> Iterator[Leak]:
    try:
        content = path.read_bytes().decode("utf-8", "replace")
    except FileNotFoundError:  # a running program has just removed it
        return
    except OSError as error:
        raise cannot_read(path, error) from error
    if not telling.in_text(content):
        return
    for place, text in _fragments(path.suffix, content):
        for word in telling.in_text(text):
            yield Leak(f"{name}{place}", word)


def _fragments(suffix: str, content: str) -> Iterator[tuple[str, str]]:
    """Yield the texts in a file other than statements, with their places."""
    if suffix == ".csv":
        yield from _csv_cells(content)
    elif suffix == ".json":
        yield from _json_texts(content, "")
    else:
        for number, line in enumerate(content.splitlines(), start=1):
            yield from _json_texts(line, f", line {number}")


def _csv_cells(content: str) -> Iterator[tuple[str, str]]:
    header: list[str] = []
    for number, row in enumerate(csv.reader(io.StringIO(content, newline="")), start=1):
        header = header or row
        for column, cell in zip_longest(header, row, fillvalue=""):
            if column not in _IGNORED_NAMES:
                yield f", row {number}, {column}", cell


def _json_texts(text: str, place: str) -> Iterator[tuple[str, str]]:
    """Yield the texts in a JSON document with their places, or ``text`` itself if it is not JSON."""
    try:
        value = parse_json(text)
    except ValueError:
        yield place, text
        return
    yield from _texts(value, place, _IGNORED_NAMES)


def _texts(value: Any, place: str, ignored_names: frozenset[str]) -> Iterator[tuple[str, str]]:
    """Yield every name and value in a JSON value as text, with its place."""
    if isinstance(value, dict):
        for name, inner in value.items():
            yield place, name
            if name not in ignored_names:
                yield from _texts(inner, f"{place}, {name}", ignored_names)
    elif isinstance(value, list | tuple):
        for inner in value:
            yield from _texts(inner, place, ignored_names)
    elif value is not None and not isinstance(value, bool):
        yield place, str(value)


def _revealing_words(tables: Tables) -> set[str]:
    spellings: set[str] = set()

    def collect(value: Any) -> None:
        if isinstance(value, Mapping):
            for name, inner in value.items():
                if name not in _HARMLESS_NAMES:
                    collect(inner)
        elif isinstance(value, list | tuple):
            for inner in value:
                collect(inner)
        elif isinstance(value, str):
            spellings.add(value)
        elif isinstance(value, int | float) and not isinstance(value, bool) and value:
            spellings.update(_notations(value))

    for table in ("liquids", "conditions"):
        collect(tables[table])
        spellings.update(tables[table])
    return spellings


def _all_notations(values: Iterable[float]) -> set[str]:
    return {word for value in values for word in _notations(value)}


def _notations(value: float) -> Iterator[str]:
    """Yield the notations of a number, unchanged and, since it may be in milliseconds, in s, µs and ns."""
    for scaled in (value, value / 1000, value * 1000, value * 1_000_000):
        yield repr(scaled)
        if float(scaled).is_integer():
            yield str(int(scaled))
            yield repr(float(scaled))


def _count_digits(word: str) -> int:
    """Return the number of significant digits of a number."""
    return len(re.sub(r"[^0-9]", "", word.partition("e")[0]).strip("0"))
