"""Progress on the terminal, for every command that may take over two seconds."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Protocol


class ShowProgress(Protocol):
    """Shows what is being done, and which share of all is done (0 to 1), if that is known."""

    def __call__(self, what: str, share: float | None = None) -> None: ...  # noqa: D102


@contextmanager
def progress(otherwise: Callable[[str], object] | None = None) -> Iterator[ShowProgress]:
    """Show progress below what is printed, on standard error, and remove it at the end of the block.

    Print nothing on standard output inside the block.

    Parameters
    ----------
    otherwise : callable, optional
        Takes what is being done where standard error is no terminal; by default nothing is shown there.

    Yields
    ------
    ShowProgress
    """
    if not sys.stderr.isatty():

        def plainly(what: str, share: float | None = None) -> None:
            if otherwise is not None:
                otherwise(what)

        yield plainly
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (BarColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True, redirect_stdout=False) as shown:
        task = shown.add_task("", total=None)

        def show(what: str, share: float | None = None) -> None:
            shown.update(task, description=what, total=None if share is None else 1.0, completed=share or 0.0)

        yield show
