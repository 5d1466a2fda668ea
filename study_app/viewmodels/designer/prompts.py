"""What the study designer asks before some steps."""

from dataclasses import dataclass

from study_app.authoring.changes.initial_values import counted_elements, singular
from study_app.authoring.changes.series import members, number_row, number_rows
from study_app.authoring.edited_study import Study
from study_app.authoring.fields import Row, label_of
from study_app.authoring.outline import title_of
from study_app.authoring.writer.refused import Refused
from study_app.number_text import exact_text
from study_app.protocol.source.document import Path
from study_app.viewmodels.designer.requests import AskSeries, MakeSeries


@dataclass(frozen=True, slots=True)
class DeletePrompt:
    """What refers to an element that is to be deleted.

    Attributes
    ----------
    path : tuple of str or int
        The element.
    title : str
        What it is called.
    references : tuple of str
        The places that name it, in words.
    others : tuple of (str, str)
        Id and title of what could be named in its place.
    also : tuple of path
        Others that are deleted with it.
    together : tuple of str
        Elements that cannot be without it, with kind and title.
    """

    path: Path
    title: str
    references: tuple[str, ...]
    others: tuple[tuple[str, str], ...] = ()
    also: tuple[Path, ...] = ()
    together: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class SeriesPrompt:
    """What a series is asked for with.

    Attributes
    ----------
    path : tuple of str or int
        The element, () where it is still to be chosen.
    title : str
        What it is called; of one to be chosen its kind, such as "condition".
    fields : tuple of (path, str)
        Its numbers, each with its words and unit.
    among : tuple of (path, str)
        The elements that it is chosen from, each with its title; () where there is one only.
    """

    path: Path
    title: str
    fields: tuple[tuple[Path, str], ...]
    among: tuple[tuple[Path, str], ...] = ()


@dataclass(frozen=True, slots=True)
class SeriesWay:
    """What helps where a series is refused: the words of its button, what they mean, and the series that is made."""

    words: str
    meaning: str
    asks: MakeSeries


@dataclass(frozen=True, slots=True)
class SeriesPlan:
    """What a series will be.

    Attributes
    ----------
    lines : tuple of str
        Each element: what it is called, its number and its id.
    refusal : str
        Why it cannot be made with these values, "" where it can.
    make : str
        What the button says that makes it.
    ways : tuple of SeriesWay
        What helps where it cannot be made.
    """

    lines: tuple[str, ...] = ()
    refusal: str = ""
    make: str = "Make the series"
    ways: tuple[SeriesWay, ...] = ()


def series_prompt(study: Study, asked: AskSeries) -> SeriesPrompt | None:
    """Return what a series is asked for with; None where no element has a number."""
    document = study.document
    among = [path for path in dict.fromkeys(asked.among) if number_rows(document, path)]
    path = among[0] if len(among) == 1 else asked.path
    fields = tuple((row.path, _in_words(row)) for row in number_rows(document, path))
    choices = tuple((one, title_of(document, one)) for one in among) if len(among) > 1 else ()
    if not fields and not choices:
        return None
    title = title_of(document, path) if fields else singular(among[0][0])
    return SeriesPrompt(path if fields else (), title, fields, choices)


def series_plan(study: Study, path: Path, field: Path, values: str) -> SeriesPlan:
    """Return what a series with these values will be."""
    if not values.strip():
        return SeriesPlan()
    try:
        row = number_row(study.document, path, field)
        made = members(study, path, row, values)
    except Refused as refusal:
        return refused_plan(refusal)
    first = made[0].title if made[0].titles or made[0].name != path[1] else title_of(study.document, path)
    lines = (
        f"{first if at == 0 else one.title}: {exact_text(one.value)} {row.unit}".rstrip() + f"  ·  {one.name}"
        for at, one in enumerate(made)
    )
    return SeriesPlan(tuple(lines), make=f"Make {counted_elements(len(made), path[0])}")


def refused_plan(refusal: Refused) -> SeriesPlan:
    """Return the plan of a series that cannot be made."""
    words = str(refusal).rstrip(".")
    return SeriesPlan(refusal=f"{words[:1].upper()}{words[1:]}.")


def _in_words(row: Row) -> str:
    words = ", ".join(label_of(step) for step in row.path[2:])
    return f"{words} [{row.unit}]" if row.unit else words
