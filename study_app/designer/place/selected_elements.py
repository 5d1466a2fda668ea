"""What is asked of the selected elements: to copy, move, delete or join them, or to make a series."""

from collections.abc import Callable

from PySide6.QtCore import QObject, Signal

from study_app.designer.form.element_form import FormCard
from study_app.designer.outline.card import OutlineCard
from study_app.designer.outline.outline_rows import ElementPath
from study_app.designer.place.designer_view import DesignerView
from study_app.designer.place.requests import AskSeries, DuplicateElement, MoveElement


class SelectedElements(QObject):
    """The element of the form, and those that the outline selects with it.

    ``asked`` carries a request of `requests`, ``delete_asked`` the element and the others; before
    each request, ``typed`` asks to hand on what is being typed. ``selected`` carries another element.
    """

    typed = Signal()
    asked = Signal(object)
    delete_asked = Signal(object, object)
    series_asked = Signal(object)
    selected = Signal(object)

    def __init__(self, outline: OutlineCard, form: FormCard, view: Callable[[], DesignerView]) -> None:
        super().__init__()
        self._outline, self._form, self._view = outline, form, view

    def _several(self) -> tuple[ElementPath, tuple[ElementPath, ...]]:
        form = self._view().form
        path = () if form is None else form.path
        return path, tuple(one for one in self._outline.selected if one != path)

    def join(self, path: ElementPath, all_between: bool) -> None:
        """Select a question with the one of the form, or no longer; where none is edited, open it."""
        form = self._view().form
        if form is None or form.path[:-1] != path[:-1]:
            self.selected.emit(path)
        elif all_between:
            first, last = sorted((int(form.path[-1]), int(path[-1])))
            self._outline.select_several(tuple((*path[:-1], at) for at in range(first, last + 1)))
        else:
            self._outline.select_several((path,), selects=path not in self._outline.selected)

    def duplicate(self) -> None:
        """Ask for a copy of each."""
        path, also = self._several()
        if self._form.head.copy.isEnabled():
            self.typed.emit()
            self.asked.emit(DuplicateElement(path, also))

    def make_series(self) -> None:
        """Ask for copies of the form's element that differ in one number."""
        form = self._view().form
        if form is not None:
            self.typed.emit()
            self.series_asked.emit(AskSeries(form.path))

    def delete(self) -> None:
        """Ask to delete them."""
        path, also = self._several()
        if self._form.head.delete.isEnabled():
            self.typed.emit()
            self.delete_asked.emit(path, also)

    def move_by(self, by: int) -> None:
        """Ask to move them up (-1) or down (1)."""
        path, also = self._several()
        if path and not self._view().header.read_only:
            self.typed.emit()
            self.asked.emit(MoveElement(path, by, also))
