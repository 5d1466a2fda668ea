"""Home in its window, with sessions that were held."""

from PySide6.QtCore import Qt

from study_app.designer import version_rows
from study_app.gui.home.main_window import MainWindow
from study_app.gui.home.view import HomePlace
from study_app.gui.widgets.main_view import Place
from tests.studies import begun


def hold(folder, participant, *, simulated=False, study="demo"):
    with begun(folder, participant, study, simulated=simulated) as store:
        store.finish("completed")


def open_home(qtbot, results, size=None):
    others = dict.fromkeys(("designer", "lab", "results", "devices", "machine", "help"), Place)
    window = MainWindow({"home": lambda: HomePlace(results, lambda: version_rows), **others})
    qtbot.addWidget(window)
    if size is not None:
        window.resize(size)
    window.show()
    home = window.place("home")
    home.main = window  # or it would be collected here
    qtbot.waitUntil(lambda: not home.is_reading and home.sessions.where.text() != "")
    return home


def cell(home, row, heading, role=Qt.ItemDataRole.AccessibleTextRole):
    """Return the text of a cell in the table of sessions."""
    model = home.sessions.rows.table.model()
    across = Qt.Orientation.Horizontal
    column = [model.headerData(at, across) for at in range(model.columnCount())].index(heading)
    return model.index(row, column).data(role)
