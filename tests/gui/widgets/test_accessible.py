"""What a screen reader finds: the participant's window, headings, plots, and the answer that was just chosen."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QAccessible
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel, QPushButton, QWidget

from study_app.gui.home.startup_window import OpeningWindow
from study_app.gui.lab.lab_plots import ForceCard as LabForceCard
from study_app.gui.lab.lab_plots import SpeedCard
from study_app.gui.operator.force_plots import ForceCard
from study_app.gui.operator.plot_cards import LatenessCard, PositionCard
from study_app.gui.participant.pages import screen_reader
from study_app.gui.participant.window import ParticipantWindow
from study_app.gui.preflight.window import PreflightWindow
from study_app.gui.sessions.motion_plots import MotionPlot
from study_app.gui.widgets.controls import Choice
from study_app.gui.widgets.labels import Elided, figures, label
from study_app.gui.widgets.live_plots import Plot
from study_app.protocol.wording.languages import words
from tests.gui.small import ManualClock, questionnaire, text_page


def told_of(widget):
    return QAccessible.queryAccessibleInterface(widget)


@pytest.fixture
def participant(qtbot):
    window = ParticipantWindow(words("en"), clock=ManualClock(), windowed=True)
    qtbot.addWidget(window)
    window.may_close = True
    return window


def test_the_participants_window_has_the_role_and_name_of_a_window(participant):
    window = told_of(participant)
    assert window.role() == QAccessible.Role.Window
    assert window.text(QAccessible.Text.Name) == participant.windowTitle()


def test_titles_are_headings_and_other_labels_are_not(qtbot, participant):
    for role in ("display", "title", "title_dense", "card"):
        made = label("First", role)
        qtbot.addWidget(made)
        made.setText("Second")
        heading = told_of(made)
        assert (heading.role(), heading.text(QAccessible.Text.Name)) == (QAccessible.Role.Heading, "Second")
    body = label("Text", "body")
    qtbot.addWidget(body)
    assert told_of(body).role() == QAccessible.Role.StaticText
    participant.show_page(text_page("instructions"))
    titles = [one for one in participant.findChildren(QLabel) if told_of(one).role() == QAccessible.Role.Heading]
    assert titles[-1].text() == "Before you begin"


@pytest.mark.parametrize(
    "make",
    [
        lambda: LatenessCard(0.002),
        lambda: PositionCard(0.05, pointer=True),
        lambda: ForceCard(8.0),
        lambda: PreflightWindow(2000.0),
        LabForceCard,
        SpeedCard,
    ],
)
def test_every_plot_has_a_name_and_a_sentence(qtbot, make):
    made = make()
    qtbot.addWidget(made)
    plots = made.findChildren(Plot)
    assert plots
    for plot in plots:
        told = told_of(plot)
        assert told.role() == QAccessible.Role.Chart
        assert told.text(QAccessible.Text.Name)
        sentence = told.text(QAccessible.Text.Description)
        assert sentence.endswith(".")
        assert len(sentence.split()) > 5


def test_a_motion_says_its_range(qtbot):
    plot = MotionPlot()
    qtbot.addWidget(plot)
    plot.show_sentence("This trial has no recording.")
    assert told_of(plot).text(QAccessible.Text.Description) == "This trial has no recording."


def test_a_chosen_answer_is_announced_as_checked(participant, monkeypatch):
    told = []

    def update(event):
        interface = told_of(event.object())
        told.append((event.type(), interface.text(QAccessible.Text.Name), bool(interface.state().checked)))

    monkeypatch.setattr(screen_reader.QAccessible, "isActive", lambda: True)
    monkeypatch.setattr(screen_reader.QAccessible, "updateAccessibility", update)
    participant.open_on()
    participant.show_page(questionnaire())
    row = participant.widget.fields[0]
    QTest.keyClick(row, Qt.Key.Key_3)
    assert (QAccessible.Event.Focus, "3 Somewhat disagree", True) in told
    participant.close()


@pytest.mark.parametrize(
    "make", [lambda: PreflightWindow(2000.0), lambda: OpeningWindow("Preparing demo", "Participant P001")]
)
def test_windows_before_a_session_are_windows(qtbot, make):
    window = make()
    qtbot.addWidget(window)
    assert told_of(window).role() == QAccessible.Role.Window


def test_the_participants_window_stays_one_whatever_is_connected_to_it(participant):
    button = QPushButton()
    button.clicked.connect(participant.come_forward)
    participant.open_on()
    assert told_of(participant).role() == QAccessible.Role.Window
    participant.close()


def test_the_title_of_questions_is_a_heading_and_a_number_is_none(qtbot, participant):
    participant.show_page(questionnaire())
    labels = participant.widget.findChildren(QLabel)
    headings = [one.text() for one in labels if told_of(one).role() == QAccessible.Role.Heading]
    assert headings == [participant.widget.accessibleName()]
    clock = figures("0:03", "card")
    qtbot.addWidget(clock)
    assert told_of(clock).role() == QAccessible.Role.StaticText
    card = Elided("card")
    qtbot.addWidget(card)
    card.show_text("A first look")
    assert told_of(card).role() == QAccessible.Role.Heading
    assert told_of(card).text(QAccessible.Text.Name) == "A first look"


def test_a_choice_is_labelled_by_what_it_is_of(qtbot):
    window = QWidget()
    qtbot.addWidget(window)
    choice = Choice()
    choice.setAccessibleName("Sessions shown")
    choice.addItem("Participants (0)")
    choice.setParent(window)
    window.show()
    labels = [one for one in window.findChildren(QLabel) if one.buddy() is choice]
    assert [(one.text(), one.isVisible()) for one in labels] == [("Sessions shown", False)]


@pytest.mark.slow
def test_a_role_goes_with_its_widget(qtbot):
    window = QWidget()
    qtbot.addWidget(window)
    for number in range(600):
        made = label(f"Heading {number}", "card")
        made.setParent(window)
        assert told_of(window).child(0).role() == QAccessible.Role.Heading
        made.setParent(None)
        made.deleteLater()
        QTest.qWait(0)
