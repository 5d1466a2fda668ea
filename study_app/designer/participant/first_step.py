"""Which step of a session shows an element of the study first."""

from collections.abc import Iterable, Iterator, Mapping
from typing import TypeAlias

from study_app.designer.document.names import named_places
from study_app.protocol.orders.schedule import FormStep, PageStep, Step, Trial
from study_app.protocol.source.document import Path
from study_app.session.transitions.page_builder import Preview

Graph: TypeAlias = Mapping[Path, frozenset[Path]]
"""What each table names, by paths: ``("conditions", "syrup")`` → ``{("liquids", "syrup")}``."""


def first_step(shown: Preview, path: Path) -> int:
    """Return the index of the first step that shows an element; 0 where no step is about it.

    Parameters
    ----------
    shown : Preview
        The session.
    path : tuple of str or int
        The element, or a place within it: ``("conditions", "water")``, a question, a text of a page.
    """
    graph = graph_of(shown.protocol.model_dump())
    tables = (_shown_by(shown, step, graph) for step in shown.schedule.steps)
    return next((at for at, found in enumerate(tables) if path[:2] in found), 0)


def graph_of(document: Mapping[str, object]) -> Graph:
    """Return what each table of a study names."""
    found: dict[Path, set[Path]] = {}
    for place, named in named_places(document):
        found.setdefault(place[:2], set()).add(named[:2])
    return {table: frozenset(named) for table, named in found.items()}


def reached(graph: Graph, first: Iterable[Path]) -> frozenset[Path]:
    """Return tables and all that they name, directly or not."""
    found = dict.fromkeys(first)
    todo = list(found)
    for table in todo:  # grows while it is read
        new = [named for named in graph.get(table, ()) if named not in found]
        found |= dict.fromkeys(new)
        todo += new
    return frozenset(found)


def _shown_by(shown: Preview, step: Step, graph: Graph) -> frozenset[Path]:
    """Return the tables that a step presents, and what these name; of a trial only its own condition."""
    if isinstance(step, PageStep):
        return reached(graph, [("pages", step.page_id)])
    if isinstance(step, FormStep):
        return reached(graph, [("questionnaires", step.form)])
    block: Path = ("blocks", step.block)
    parts = [part for part in graph.get(block, ()) if part[0] not in {"conditions", "pages"}]
    return reached(graph, [*parts, *_presented(shown, step)]) | {block}


def _presented(shown: Preview, trial: Trial) -> Iterator[Path]:
    """Yield the conditions that a trial names; those of a varied number follow from the block's stimulus."""
    for name in (shown.codes[trial.block][trial.code], shown.protocol.blocks[trial.block].standard):
        if name in shown.protocol.conditions:
            yield ("conditions", str(name))
