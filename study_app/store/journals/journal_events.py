"""The events of a session's journal: one frozen class for each kind of line, which reads, writes and documents itself.

The docstring of a class and the names of its required fields are its row in the dictionary of data. A field with a
default may be missing from a line; one that may be None without a default is then written as null. Fields that a class
does not declare (the measures of a task, fields of another version) are in ``others``.
"""

import dataclasses
import inspect
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Annotated, Any, ClassVar, TypeAlias, dataclass_transform, get_args, get_type_hints

from study_app.errors import StoreError
from study_app.protocol.questions import STATEMENT
from study_app.store.files.columns import DELIVERED, TRIALS
from study_app.store.files.folders import PARTICIPANT_ID, RECORDING_NAME, STUDY_NAME

_MAX_SHOWN = 200  # greatest number of characters of a bad value shown in messages

CAUSE_WITHHELD = "the session was stopped"
"""Text of `Broke` for a failed device or video in a study with videos: the cause would reveal the condition."""

UNDELIVERED = "invalid"
"""The outcome of a trial of which an interval was not delivered as requested."""
COMPLETED, INCOMPLETE = "completed", "incomplete"
REACHED_END = (COMPLETED, INCOMPLETE)
"""The status of sessions that reached their last page: with enough trials, or with more missing than permitted."""

_MOST_SECONDS = 1e9  # greatest time on a session's clock [s]
_MOST = 10**30  # greatest integer that the program writes
_MAY_BE_NULL = (
    "level", "standard", "part", "value", "answer", "onset_s", "first_s", "last_s", "gap_s", "device",
    "t_task_s", "scene",
)  # fmt: skip
_COMMON_FIELDS = ("n", "t_s", "at", "previous")
_RESPONSE_FIELDS = ("item", "number", "kind", "value", "onset_s", "first_s", "last_s", "changes")


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of value: its description, its check, and its type in JSON Schema with further keywords."""

    description: str
    holds: Callable[[object], bool]
    type: str
    more: Mapping[str, Any] = field(default_factory=dict, hash=False)


def _is_integer(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and abs(value) <= _MOST


def _is_number(value: object) -> bool:
    return _is_integer(value) or (isinstance(value, float) and math.isfinite(value))


def _is_time(value: object) -> bool:
    if not isinstance(value, str):
        return False
    try:
        moment = datetime.fromisoformat(value)
    except ValueError:
        return False
    return moment.tzinfo is not None and 1 < moment.year < 9999  # in any zone


def _are_texts(value: object) -> bool:
    return isinstance(value, list) and all(isinstance(text, str) for text in value)


def _are_answers(value: object) -> bool:
    return isinstance(value, list) and all(
        isinstance(answer, dict)
        and all(
            name in answer and is_valid_value(_kind_name(answer, name), answer[name])
            for name in _RESPONSE_FIELDS
            if name != "kind"
        )
        for answer in value
    )


def _text_matching(description: str, pattern: re.Pattern[str]) -> Kind:
    def matches(value: object) -> bool:
        return isinstance(value, str) and pattern.fullmatch(value) is not None

    return Kind(description, matches, "string", {"pattern": f"^({pattern.pattern})$"})


Text: TypeAlias = Annotated[str, Kind("text", lambda value: isinstance(value, str), "string")]
_StudyName: TypeAlias = Annotated[str, _text_matching("study's name", STUDY_NAME)]
_ParticipantId: TypeAlias = Annotated[str, _text_matching("participant's id", PARTICIPANT_ID)]
_RecordingName: TypeAlias = Annotated[str, _text_matching("recording's name", RECORDING_NAME)]
_Flag: TypeAlias = Annotated[bool, Kind("flag", lambda value: isinstance(value, bool), "boolean")]
_Integer: TypeAlias = Annotated[int, Kind("integer", _is_integer, "integer")]
Number: TypeAlias = Annotated[float, Kind("number", _is_number, "number")]
Time: TypeAlias = Annotated[str, Kind("time", _is_time, "string", {"format": "date-time"})]
_Described: TypeAlias = Annotated[Mapping[str, Any], Kind("object", lambda value: isinstance(value, dict), "object")]
_Checks: TypeAlias = Annotated[
    Sequence[Mapping[str, Any]],
    Kind(
        "list of objects",
        lambda value: isinstance(value, list) and all(isinstance(item, dict) for item in value),
        "array",
        {"items": {"type": "object"}},
    ),
]
Numbers: TypeAlias = Annotated[
    Mapping[str, float],
    Kind(
        "table of numbers",
        lambda value: isinstance(value, dict) and all(map(_is_number, value.values())),
        "object",
        {"additionalProperties": {"type": "number"}},
    ),
]
Texts: TypeAlias = Annotated[Sequence[str], Kind("list of texts", _are_texts, "array", {"items": {"type": "string"}})]
_NumberList: TypeAlias = Annotated[
    Sequence[float],
    Kind(
        "list of numbers",
        lambda value: isinstance(value, list) and all(map(_is_number, value)),
        "array",
        {"items": {"type": "number"}},
    ),
]
Answers: TypeAlias = Annotated[
    Sequence["Response"], Kind("list of answers", _are_answers, "array", {"items": {"$ref": "#/$defs/answer"}})
]
_AnyAnswer: TypeAlias = Annotated[
    Any,
    Kind(
        "answer",
        lambda value: isinstance(value, str) or _is_number(value) or _are_texts(value),
        "string",
        {"type": ["string", "number", "array"], "items": {"type": "string"}},
    ),
]
_OldAnswer: TypeAlias = Annotated[Any, Kind("integer", _is_integer, "integer")]
"""Of a question without a kind, in format 1."""


Which: TypeAlias = tuple[int, int, int | None]
"""Trial, attempt and interval, which is None for a trial."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """The answer to a question so far; times are seconds on the session's clock, None before the event.

    After the first choice, ``value`` is None for "cannot judge". ``last_s`` is the time of the last change, ``changes``
    the number of changes after the first choice.
    """

    onset_s: Number | None = None
    first_s: Number | None = None
    last_s: Number | None = None
    changes: _Integer = 0
    value: _OldAnswer | None = None

    @property
    def given(self) -> bool:
        """Whether any answer was chosen."""
        return self.first_s is not None

    def shown(self, at_s: float) -> "Answer":
        """Return the answer after its question was shown, possibly again."""
        return self if self.onset_s is not None else dataclasses.replace(self, onset_s=at_s)

    def chosen(self, at_s: float, value: Any) -> "Answer":
        """Return the answer after a choice; the last choice counts."""
        if not self.given:
            return dataclasses.replace(self, first_s=at_s, last_s=at_s, value=value)
        if self.value == value:
            return self
        return dataclasses.replace(self, last_s=at_s, value=value, changes=self.changes + 1)

    def removed(self) -> "Answer":
        """Return the answer after it was removed."""
        return Answer(onset_s=self.onset_s)


@dataclass(frozen=True, slots=True, kw_only=True)
class Response(Answer):
    """A confirmed answer; ``number`` is its question's on the page, ``kind`` the kind of question."""

    item: Text
    number: _Integer
    kind: Text = STATEMENT

    def fields(self) -> dict[str, Any]:
        """Return the response as written in a line."""
        return {name: getattr(self, name) for name in _RESPONSE_FIELDS}


def _journal_name(kind: type) -> str:
    return re.sub("(?<=[a-z])(?=[A-Z])", "_", kind.__name__).lower()


@dataclass_transform(frozen_default=True, kw_only_default=True)
@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class Event:
    """A line of a journal; ``n``, ``at`` and ``previous`` are set when it is written (see `journal`)."""

    one_of: ClassVar[tuple[str, ...]] = ()
    """Fields of which every line has exactly one."""
    declared: ClassVar[tuple[str, ...]] = ()
    required: ClassVar[tuple[str, ...]] = ()
    n: _Integer = 0
    t_s: Number = 0.0
    at: Time = ""
    previous: Text | None = None
    others: Mapping[str, Any] = field(default_factory=dict)

    def __init_subclass__(cls, *, group: bool = False) -> None:
        declared = [
            declaration
            for declaration in dataclasses.fields(dataclass(frozen=True, kw_only=True, repr=False, eq=False)(cls))
            if declaration.name not in (*_COMMON_FIELDS, "others")
        ]
        cls.declared = tuple(declaration.name for declaration in declared)
        cls.required = tuple(declaration.name for declaration in declared if declaration.default is dataclasses.MISSING)
        if not group:
            EVENTS[_journal_name(cls)] = cls

    def __eq__(self, other: object) -> bool:  # one for all: generating it per class delays the program's start
        return type(other) is type(self) and vars(other) == vars(self)

    __hash__: ClassVar[None]  # type: ignore[assignment] # its mapping has none

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{name}={value!r}' for name, value in vars(self).items())})"

    @property
    def event(self) -> str:
        """The name in the journal."""
        return _journal_name(type(self))

    def fields(self) -> dict[str, Any]:
        """Return the event's own fields in the order in which they are written."""
        own_fields = {name: getattr(self, name) for name in self.declared}
        values = {name: value for name, value in own_fields.items() if value is not None or name in self.required}
        if "items" in values:
            values["items"] = [response.fields() for response in values["items"]]
        last_fields: dict[str, Any] = {name: values.pop(name) for name in ("invalid", "sealed") if name in values}
        return {**values, **self.others, **last_fields}

    def line(self) -> dict[str, Any]:
        """Return the whole line as it is written."""
        line = {"n": self.n, "event": self.event, "t_s": self.t_s, "at": self.at, **plain_json(self.fields())}
        return line if self.previous is None else {**line, "previous": self.previous}


EVENTS: dict[str, type[Event]] = {}
"""The class of each event by its name in the journal."""


class _UnknownEvent(Event, group=True):
    """An event of another version: its name and all its fields are in ``others``."""

    @property
    def event(self) -> str:
        """The name in the journal."""
        return str(self.others["event"])


class OfAttempt(Event, group=True):
    """An event of an attempt at a trial."""

    trial: _Integer
    attempt: _Integer

    @property
    def which(self) -> Which:
        """Trial, attempt and interval; the interval is None for a trial."""
        return self.trial, self.attempt, getattr(self, "interval", None)


class EndOfTask(OfAttempt, group=True):
    """The end of a task, with its measures in ``others``.

    ``reached_s`` lists when the targets were reached [s, on the task's clock], if `target_reached` lines would have
    revealed the condition while the key was sealed.
    """

    reached_s: _NumberList | None = None

    def fields(self) -> dict[str, Any]:
        """Return the event's own fields in the order in which they are written: measures first if interrupted."""
        fields = super().fields()
        if fields["outcome"] != "interrupted":
            return fields
        which: dict[str, Any] = {
            name: fields[name] for name in ("trial", "attempt", "outcome", "interval") if name in fields
        }
        return {**self.others, **which, **fields}


class SessionStarted(Event):
    """The session began: always the first line.

    `receipt_hash` is the SHA-256 of the receipt without what changes later (of `session_resumed`: of its entry there);
    `measures_sealed` says whether sealed columns are encrypted, `own_codes` whether codes are the participant's own.
    `entry` is the participant's entry in the allocation to groups, or the place in a pre-existing `group`;
    `place_in_group` says that the place in the group assigns rows of squares.
    """

    format: _Integer | None = None
    participant: _ParticipantId
    session: _Integer
    study: _StudyName
    seed: _Integer
    language: Text
    operator: Text
    simulated: _Flag
    pilot: _Flag
    recordings: _Flag
    key_hash: Text
    protocol_hash: Text
    receipt_hash: Text | None = None
    version: Text
    row_of: _ParticipantId | None = None
    device: Text | None
    limits: Numbers
    measures_sealed: _Flag | None = None
    own_codes: _Flag | None = None
    protocol_format: _Integer | None = None
    intervals: _Flag | None = None
    entry: _Integer | None = None
    group: Text | None = None
    place_in_group: _Flag | None = None


class SessionResumed(Event):
    """It was resumed after its program had ended; `gap_s` is the time since the line before."""

    gap_s: Number | None
    operator: Text
    torn_bytes: _Integer
    device: Text | None
    version: Text
    receipt_hash: Text | None = None


class Allocated(Event):
    """The participant has this entry in the allocation to groups; `sealed` holds the group. Once per participant."""

    entry: _Integer
    group: Text | None = None
    sealed: Text


class Preflight(Event):
    """The checks before the first page, as accepted by the operator."""

    checks: _Checks


class PageShown(Event):
    """A page of text was shown."""

    page: Text


class PageLeft(Event):
    """The participant left it.

    Of a consent `text_sha256` is the SHA-256 of title and paragraphs as they were read, in UTF-8 with blank
    lines between them, and `study_version` the version of the study.
    """

    page: Text
    text_sha256: Any = None
    study_version: Any = None


class LanguageChosen(Event):
    """The participant chose another language of the study."""

    language: Text


class TrialStarted(OfAttempt):
    """A trial was presented; with a design `sealed` contains level, standard, arrangement and catch, encrypted.

    `sealed_code` contains the code that is the same for everybody, where `code` is the participant's own.
    """

    block: Text
    phase: Text
    part: _Integer | None
    index: _Integer
    of: _Integer
    code: Text
    level: Number | None = None
    standard: Number | None = None
    arrangement: Text | None = None
    catch: Any = None
    sealed: Text | None = None
    sealed_code: Text | None = None

    @property
    def has_intervals(self) -> bool:
        """Whether it is a trial of intervals, whose contents are listed in the line."""
        return self.sealed is not None or self.arrangement is not None

    def fields(self) -> dict[str, Any]:
        """Return the event's own fields in the order in which they are written; a missing level is null."""
        fields = super().fields()
        if self.arrangement is None:
            return fields
        presented = {name: getattr(self, name) for name in ("level", "standard", "arrangement", "catch")}
        return {**{name: value for name, value in fields.items() if name not in presented}, **presented}


class IntervalStarted(OfAttempt):
    """An interval of a trial was presented."""

    interval: _Integer


class IntervalEnded(EndOfTask):
    """The interval's task ended, with its measures; `sealed` contains the sealed columns, encrypted.

    `invalid` names the limits that it breaks: the trial is then presented again.
    """

    interval: _Integer
    outcome: Text
    invalid: Texts | None = None
    sealed: Text | None = None


class FeedbackShown(OfAttempt):
    """The participant saw whether the answer was correct."""


class PassedOver(Event):
    """A trial, or the break after it, was not due."""

    one_of = ("trial", "page")
    trial: _Integer | None = None
    page: Text | None = None
    reason: Text


class Stepped(OfAttempt):
    """The participant adjusted the level by so many steps, more of the varied number above 0.

    `scene` is the number of the presented scene from then on, n/a where no force depends on it.
    """

    steps: _Integer
    scene: _Integer | None


class TargetReached(Event):
    """A target was reached, on the task's clock.

    While measures are sealed no such line is written, since their number and times would reveal a delay: the end of
    the task has the times in its `sealed` text, as `reached_s`.
    """

    trial: _Integer
    target: _Integer
    t_task_s: Number | None


class TrialEnded(EndOfTask):
    """The trial's task ended, with its measures; `sealed` contains the sealed columns, encrypted."""

    outcome: Text
    sealed: Text | None = None


class Recorded(OfAttempt):
    """The trial's recording is complete on the disk, with these names and checksums.

    `sealed` contains the numbers of samples and frames, and the checksums of the opened files, encrypted.
    """

    one_of = ("samples_recorded", "sealed")
    interval: _Integer | None = None
    recording: _RecordingName
    recording_frames: _RecordingName
    samples_recorded: _Integer | None = None
    samples_unrecorded: _Integer
    frames_recorded: _Integer | None = None
    sha256: Text
    frames_sha256: Text
    opened_sha256: Text | None = None
    opened_frames_sha256: Text | None = None
    sealed: Text | None = None


class RecordingLost(OfAttempt):
    """The trial's recording could not be stored."""

    interval: _Integer | None = None
    reason: Text


class OutletLost(Event):
    """Markers or samples no longer reach other programs by this outlet."""

    outlet: Text
    reason: Text


class FormShown(Event):
    """A questionnaire was shown on its own, `after` a block; missing before the first."""

    form: Text
    after: Text | None = None


class _ItemEvent(Event, group=True):
    """An event of a question, of a trial or a form."""

    one_of = ("trial", "form")
    trial: _Integer | None = None
    form: Text | None = None
    item: Text


class ItemShown(_ItemEvent):
    """A question was shown, of a trial or a form."""


class Choice(_ItemEvent):
    """An answer was chosen; the last one counts."""

    kind: Text | None = None
    value: _OldAnswer | None


class AnswerRemoved(_ItemEvent):
    """An answer was taken back, or an earlier one hid its question."""


class Responses(OfAttempt):
    """The page of questions was confirmed: every answer."""

    items: Answers


class FormAnswered(Event):
    """The form was confirmed: every answer; `after` is the block before it."""

    form: Text
    after: Text | None = None
    items: Answers


class _PersonEvent(Event, group=True):
    """An action of a person or of the program."""

    by: Text


class Paused(_PersonEvent):
    """The session was paused."""


class Resumed(_PersonEvent):
    """The pause ended."""


class ForceStopped(_PersonEvent):
    """The force was stopped."""


class ForceRestored(_PersonEvent):
    """The force was turned on again."""


class Note(Event):
    """The operator wrote a note, or marked the trial."""

    kind: Text
    text: Text


class Repeat(Event):
    """The operator repeated the trial."""

    trial: _Integer
    reason: Text


class Broke(Event):
    """Device, servo or program failed. In a study with videos `what` does not say whether a device or a video did."""

    what: Text


class DeviceReconnected(Event):
    """The failed device, or video, was opened again; `described` is the device from then on.

    The force stayed off until `resumed`.
    """

    device: Text | None
    described: _Described


class SessionEnded(Event):
    """The session ended: always the last line.

    `within_limits` says whether all main trials were within the limits, also those of sealed measures; it is written in
    a sealed session, so that unblinding does not change the session's validity.
    """

    status: Text
    reason: Text
    within_limits: _Flag | None = None


def _field_kinds() -> Iterator[tuple[str, tuple[Kind, bool]]]:
    aliases: tuple[Any, ...] = (Text, Time, Number, _Integer, _Flag)
    column_kinds = {alias.__metadata__[0].description: alias.__metadata__[0] for alias in aliases}
    yield from ((column.name, (column_kinds[column.kind], True)) for column in (*TRIALS, *DELIVERED))
    for event_class in (Response, Event, *EVENTS.values()):
        for name, hint in get_type_hints(event_class, include_extras=True).items():
            for annotation in (hint, *get_args(hint)):
                yield from ((name, (kind, name in _MAY_BE_NULL)) for kind in getattr(annotation, "__metadata__", ()))
    yield "answer", (_AnyAnswer.__metadata__[0], True)


_KINDS = dict(_field_kinds())
"""The kind of each field of the events that this version knows, and whether it may be null."""


def line_problem(line: Mapping[str, Any]) -> str | None:
    """Return a sentence on the first error in a line of a journal, or None.

    A line must have all fields of its event, and every field in the dictionary must be of its kind, also in events of
    another version.
    """
    event = line.get("event")
    if not isinstance(event, str):
        return "the event is missing"
    kind = EVENTS.get(event, _UnknownEvent)
    if missing := [name for name in ("n", "event", "t_s", "at", *kind.required) if name not in line]:
        return f"({event}) does not contain {', '.join(missing)}"
    if kind.one_of and sum(name in line for name in kind.one_of) != 1:
        return f"({event}) does not have exactly one of {', '.join(kind.one_of)}"
    for name in line:
        if not is_valid_value(kind_name := _kind_name(line, name), line[name]):
            return f"({event}) has {name} {shorten_value(line[name])}; expected: {_KINDS[kind_name][0].description}"
    return None if 0 <= line["t_s"] <= _MOST_SECONDS else f"({event}) has an invalid t_s, {line['t_s']:g}"


def journal_schema() -> dict[str, Any]:
    """Return the JSON Schema of a journal line in which `line_problem` finds no error."""
    field_schemas = {name: _schema_of(name) for name in _KINDS if name not in {"answer", "value"}}
    answer = {
        "type": "object",
        "properties": field_schemas,
        "required": [name for name in _RESPONSE_FIELDS if name != "kind"],
        "if": {"required": ["kind"]},
        "then": {"properties": {"value": _schema_of("answer")}},
        "else": {"properties": {"value": _schema_of("value")}},
    }
    conditions = []
    for name, kind in EVENTS.items():
        requirements: dict[str, Any] = {"description": inspect.getdoc(kind), "required": list(kind.required)}
        if kind.one_of:
            requirements["oneOf"] = [{"required": [key]} for key in kind.one_of]
        conditions.append({"if": {"properties": {"event": {"const": name}}}, "then": requirements})
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A line of journal.jsonl",
        "$defs": {"answer": answer},
        **answer,
        "properties": {**field_schemas, "t_s": {"type": "number", "minimum": 0, "maximum": _MOST_SECONDS}},
        "required": ["n", "event", "t_s", "at"],
        "allOf": conditions,
    }


def _schema_of(name: str) -> dict[str, Any]:
    kind, may_be_null = _KINDS[name]
    schema: dict[str, Any] = {"type": kind.type, **kind.more}
    if may_be_null:
        types = schema["type"]
        schema["type"] = [*([types] if isinstance(types, str) else types), "null"]
    return schema


def read_event(line: Mapping[str, Any]) -> Event:
    """Return the event of a journal line in which `line_problem` finds no error."""
    kind, others = EVENTS.get(line["event"], _UnknownEvent), dict(line)
    if kind is not _UnknownEvent:
        del others["event"]
    own = {name: others.pop(name) for name in (*_COMMON_FIELDS, *kind.declared) if name in others}
    if "items" in own:
        own["items"] = tuple(
            Response(**{name: row[name] for name in _RESPONSE_FIELDS if name in row}) for row in own["items"]
        )
    return kind(**own, others=others)


def plain_json(value: Any) -> Any:
    """Return ``value`` for JSON: numpy values as numbers and lists, tuples as lists, non-finite numbers as None."""
    if isinstance(value, dict):
        return {str(name): plain_json(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain_json(item) for item in value]
    if hasattr(value, "tolist"):  # a numpy array or number
        return plain_json(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _kind_name(fields: Mapping[str, Any], name: str) -> str:
    """Return the key of a field in `_KINDS`; an answer with a question kind has a key of its own."""
    return "answer" if name == "value" and "kind" in fields else name


def shorten_value(value: object) -> str:
    """Return ``value`` as text for messages, shortened."""
    shown = repr(value)
    return shown if len(shown) <= _MAX_SHOWN else f"{shown[:_MAX_SHOWN]}…"


def unknown_events(lines: Sequence[Event]) -> Iterator[str]:
    """Yield the names of events that are not in the dictionary, each once."""
    yield from {line.event: None for line in lines if isinstance(line, _UnknownEvent)}


def is_valid_value(name: str, value: object) -> bool:
    """Return whether ``value`` has the type of the field ``name``; an unknown field may have any."""
    if name not in _KINDS:
        return True
    kind, may_be_null = _KINDS[name]
    return may_be_null if value is None else kind.holds(value)


def start_of(lines: Sequence[Event]) -> SessionStarted:
    """Return the first line of a session's journal.

    Raises
    ------
    StoreError
        The first line is another event.
    """
    if not lines or not isinstance(start := lines[0], SessionStarted):
        raise StoreError(
            "the journal does not begin with session_started: restore it from a backup, or use a new session number"
        )
    return start
