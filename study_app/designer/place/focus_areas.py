"""The parts of the designer that the keyboard goes to: header, outline, form, views and problems."""

from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QWidget

from study_app.designer.form.typed_fields import TypedLine, TypedText
from study_app.designer.outline.outline_rows import ElementPath
from study_app.designer.place.arrangement import Arrangement
from study_app.designer.place.designer_header import DesignerHeader
from study_app.designer.place.file_editor import FileCard
from study_app.designer.problems.problems_card import ProblemsCard
from study_app.gui.widgets.main_view import last_focused

SHORTCUT = Qt.FocusReason.ShortcutFocusReason


class FocusAreas:
    """Gives the keyboard to a part of the designer, and shows the part where it is hidden."""

    def __init__(self, header: DesignerHeader, parts: Arrangement, file: FileCard, problems: ProblemsCard) -> None:
        self._header, self._parts, self._file, self._problems = header, parts, file, problems
        header.keyboard_left.connect(self.return_keyboard)

    def focus_header(self) -> None:
        """Go to the list of studies."""
        self._header.study.setFocus(SHORTCUT)

    def focus_form(self) -> None:
        """Go to the first row of the form."""
        self._parts.show_side("form")
        self._parts.form.focus_first()

    def focus_field(self, path: ElementPath) -> None:
        """Go to a field of the form, with its value selected; where it has no row, to the first row."""
        if not self.focus_row(path):
            self._parts.form.focus_first()
        elif isinstance(field := self._parts.form.focusWidget(), TypedLine | TypedText):
            field.selectAll()

    def focus_row(self, path: ElementPath) -> bool:
        """Go to a field of the form; return whether it has a row."""
        self._parts.show_side("form")
        return self._parts.form.focus(path)

    def leave_drawer(self) -> None:
        """Go to the form where the outline is a drawer."""
        if self._parts.drawer:
            self.focus_form()

    def focus_element(self) -> None:
        """Go to the selected element: to its row, or to its form where the outline is a drawer."""
        if self._parts.drawer:
            self.focus_form()
        else:
            self._parts.focus_outline()

    def return_keyboard(self) -> None:
        """Go back to where the keyboard was last in outline, form or pane; from *Find* to the selected element."""
        last = last_focused(self._parts.used)
        if last is None or last is self._parts.outline.words:
            self.focus_element()
        else:
            last.setFocus(Qt.FocusReason.OtherFocusReason)

    def focus_pane(self) -> None:
        """Go to the page of the right pane, and from within the pane to its tabs."""
        pane = self._parts.pane
        if pane.isAncestorOf(pane.window().focusWidget() or self._header):
            pane.tabs.setFocus(SHORTCUT)
        else:
            self._focus_page()

    def _focus_tabs(self) -> None:
        """Go to the tabs of the right pane; from there Tab goes to what is beside them, then to the page."""
        self._parts.show_side("pane")
        self._parts.pane.tabs.setFocus(SHORTCUT)

    def _focus_page(self) -> None:
        self._parts.show_side("pane")
        pane = self._parts.pane
        page = next(one for one in pane.pages if one.name == pane.tab)
        (page.body.focusProxy() or pane.tabs).setFocus(SHORTCUT)

    def show_tab(self, name: str) -> None:
        """Show a page of the right pane, and go to it."""
        self._parts.pane.show_tab(name)
        self._focus_page()

    def focus_problems(self) -> None:
        """Go to the list of problems."""
        self._problems.show()
        self._problems.next.setFocus(SHORTCUT)

    def switch_to_file(self) -> None:
        """Go to the file, and from there back to where the keyboard was in the form."""
        if not self._file.editor.hasFocus():
            self.show_tab("file")
            return
        last = self._parts.form.focusWidget()  # where the file was over the form, the form gets its keyboard from Qt
        self._parts.show_side("form")
        if last is not None and last.isVisible() and last.isEnabled():
            last.setFocus(SHORTCUT)
        else:
            self._parts.form.focus_first()

    def cycle(self, by: int) -> None:
        """Go to the next part, or to the one before."""
        stops: list[tuple[QWidget, Callable[[], None]]] = [
            (self._header, self.focus_header),
            (self._parts.outline, self._parts.focus_outline),
            (self._parts.form, self.focus_form),
            (self._parts.pane, self._focus_tabs),
        ]
        if self._problems.isVisible():
            stops.append((self._problems, self.focus_problems))
        focused = self._parts.window().focusWidget()
        here = next((at for at, (part, _) in enumerate(stops) if focused and part.isAncestorOf(focused)), -by)
        stops[(here + by) % len(stops)][1]()
