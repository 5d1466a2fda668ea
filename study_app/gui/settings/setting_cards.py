"""The cards of the machine's place: screens, what is seen of them, the display's offset, sessions, windows."""

from PySide6.QtCore import QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QButtonGroup, QFileDialog, QLabel, QLineEdit, QSizePolicy, QWidget

from study_app.devices.registry import list_devices, title_of
from study_app.gui.display.screens import ScreenShown
from study_app.gui.settings.display_offset import OffsetForm
from study_app.gui.settings.measured_number import LEAST_WORDS, Measure
from study_app.gui.theme.theme import PARTICIPANT, RADIUS_CONTROL, font
from study_app.gui.theme.themed import remove_widget
from study_app.gui.widgets.boxes import STRETCH, add_parts, hbox, vbox
from study_app.gui.widgets.cards import Card, Rule
from study_app.gui.widgets.controls import ActionButton, Choice, Radio, Toggle
from study_app.gui.widgets.labels import Elided, label
from study_app.store.workstation import CAMERA_LENGTH, DISTANCE_MM, LEAST_X_HEIGHT_DEG, WIDTH_MM, MachineSettings
from study_app.video.sources import USUAL

SAMPLE = "I think this feels like interacting with a liquid."
MOST_SAMPLE = 2.4


class ScreensCard(Card):
    """Every screen, and which is the participant's; ``chosen`` carries it."""

    chosen = Signal(object)
    identify_asked = Signal()
    test_asked = Signal()

    def __init__(self) -> None:
        super().__init__("Participant's screen", gap=10)
        self.radios: list[Radio] = []
        self.note = label("", "label", "warn", wraps=True)
        self.note.setMinimumWidth(LEAST_WORDS)
        self.identify = ActionButton("eye", "Identify", height=38)
        self.test = ActionButton("screen", "Display test …", height=38)
        self.identify.clicked.connect(self.identify_asked)
        self.test.clicked.connect(self.test_asked)
        self._rows = vbox(spacing=8)
        self._lines: list[QWidget] = []
        self._group: QButtonGroup | None = None
        self._shown: tuple[ScreenShown, ...] = ()
        buttons = hbox(self.identify, self.test, STRETCH, spacing=12)
        add_parts(self.column, self._rows, self.note, buttons)

    def show_screens(self, screens: tuple[ScreenShown, ...], chosen: int, missing: str) -> None:
        """Show screens; ``chosen`` is the participant's number, ``missing`` the name of one that is not there."""
        if screens != self._shown:
            self._make(screens)
        for number, radio in enumerate(self.radios, start=1):
            radio.setChecked(number == chosen)
        self.note.setText(f"{missing} is not connected; the last screen is used instead." if missing else "")
        self.note.setVisible(bool(missing))

    def _make(self, screens: tuple[ScreenShown, ...]) -> None:
        self._shown = screens
        for old in self._lines:
            remove_widget(old)
        self._group = QButtonGroup(self)
        self.radios, self._lines = [], []
        for screen in screens:
            row, radio = _screen_row(screen)
            self.radios.append(radio)
            self._group.addButton(radio)
            radio.clicked.connect(lambda _checked=False, screen=screen: self.chosen.emit(screen))
            self._lines += [Rule(), row] if self._lines else [row]
        add_parts(self._rows, *self._lines)


def _screen_row(screen: ScreenShown) -> tuple[QWidget, Radio]:
    """Return a screen's row, and the mark in it."""
    radio = Radio(f"Screen {screen.number}")
    radio.setFont(font("strong"))
    size = f"{screen.width_mm:.0f} × {screen.height_mm:.0f} mm" if screen.width_mm > 0 else "size unknown"
    about = label(f"{screen.words}  ·  {size}", "label", "text2", wraps=True)
    about.setFont(font("label", weight=400, tabular=True))
    about.setMinimumWidth(LEAST_WORDS)
    radio.setAccessibleName(f"Screen {screen.number}, {screen.name}, {screen.words}")
    name = Elided("label", "text2")
    name.show_text(screen.name)
    name.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
    head = hbox(radio, (name, 1))
    row = QWidget()
    vbox(head, hbox(about, margins=(30, 0, 0, 0)), spacing=0, margins=0, parent=row)
    return row, radio


class TextSample(QWidget):
    """A statement as large as participants read it."""

    def __init__(self) -> None:
        super().__init__()
        self.scale = 1.0
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAccessibleName(f"A statement at the size that participants see: {SAMPLE}")
        self.setFixedHeight(self.sizeHint().height())

    def show_scale(self, scale: float) -> None:
        """Show a size."""
        self.scale = scale
        self.update()

    def sizeHint(self) -> QSize:  # noqa: N802 - Qt's name
        """Return the room for the largest text on two lines."""
        return QSize(320, 112)

    def paintEvent(self, _event: QPaintEvent) -> None:  # noqa: N802 - Qt's name
        """Paint the statement as on the participant's page."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QPen(QColor(PARTICIPANT.border), 1))
        painter.setBrush(QColor(PARTICIPANT.window))
        edge = QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5)
        painter.drawRoundedRect(edge, RADIUS_CONTROL, RADIUS_CONTROL)
        painter.setPen(QColor(PARTICIPANT.text))
        painter.setFont(font("statement", scale=min(self.scale, MOST_SAMPLE)))
        room = QRectF(self.rect()).adjusted(16, 8, -16, -8)
        painter.drawText(room, Qt.AlignmentFlag.AlignVCenter | Qt.TextFlag.TextWordWrap, SAMPLE)


class SeenCard(Card):
    """From how far the screen is looked at, how wide it is, and how large words must therefore be."""

    changed = Signal(str, object)

    def __init__(self) -> None:
        super().__init__("Text size for the participant", gap=10)
        self.distance = Measure("Viewing distance, eye to screen", "mm", DISTANCE_MM)
        self.width_mm = Measure("Width of the picture on the screen", "mm", WIDTH_MM)
        self.sample = TextSample()
        self.said = label("", "label", "text2", wraps=True)
        self.said.setFont(font("label", weight=400, tabular=True))
        self.said.setMinimumWidth(LEAST_WORDS)
        self.distance.entered.connect(lambda value: self.changed.emit("viewing_distance_mm", value))
        self.width_mm.entered.connect(lambda value: self.changed.emit("screen_width_mm", value))
        add_parts(self.column, self.distance, self.width_mm, self.sample, self.said)

    def show_settings(self, settings: MachineSettings, screen: ScreenShown) -> None:
        """Show what is set, and what follows for this screen."""
        text = (
            (f"The system reports {screen.width_mm:.0f} mm.")
            if screen.width_mm > 0
            else "The system does not report it."
        )
        self.distance.show_value(settings.viewing_distance_mm, "")
        self.width_mm.show_value(
            settings.screen_width_mm,
            text if settings.screen_width_mm is None else (f"{text} The measured value is used."),
        )
        scale = settings.text_scale(screen.width_px, screen.width_mm)
        self.sample.show_scale(scale)
        self.said.setText(_size_words(settings, screen, scale))


def _size_words(settings: MachineSettings, screen: ScreenShown, scale: float) -> str:
    """Return what the distance means for the size of words, in a sentence."""
    seen = settings.x_height_deg(screen.width_px, screen.width_mm)
    if seen is None:
        return (
            "Measure the distance: text is then enlarged until an x subtends 0.4°. Until then it has its default size."
        )
    if scale == 1.0:
        return f"Default size: an x subtends {seen:.2f}°; at least {LEAST_X_HEIGHT_DEG:g}° is needed."
    return f"{scale:.2f} times the default size: an x subtends {LEAST_X_HEIGHT_DEG:g}° instead of {seen:.2f}°."


class OffsetCard(Card):
    """The display's offset as it was measured, and whether there is something to measure by."""

    changed = Signal(str, object)

    def __init__(self) -> None:
        super().__init__("Display offset", gap=8)
        self.form = OffsetForm()
        self.patch = Toggle("Square for a photodiode in the tank's corner")
        self.patch.setFont(font("body"))
        self.patch.clicked.connect(lambda on: self.changed.emit("photodiode", on))
        add_parts(self.column, self.form, Rule(), self.patch)


class SessionsCard(Card):
    """What a new session begins with."""

    changed = Signal(str, object)
    devices_asked = Signal()

    def __init__(self) -> None:
        super().__init__("New sessions", gap=10)
        self.device = Choice()
        self.device.setFont(font("body"))
        self.device.setAccessibleName("Device of new sessions")
        for name in list_devices():
            self.device.addItem(title_of(name), name)
        self.devices = ActionButton("", "Devices", height=40)
        self.folder = Elided("label", "text")
        self.change = ActionButton("", "Change …", height=40)
        self.device.activated.connect(lambda _index: self.changed.emit("device", self.device.currentData()))
        self.devices.clicked.connect(self.devices_asked)
        self.change.clicked.connect(self._choose)
        for name, field, button in (
            ("Device", self.device, self.devices),
            ("Workspace, the folder of protocols and results", self.folder, self.change),
        ):
            add_parts(self.column, _named(name, field), hbox((field, 1), button, spacing=8))
        self.camera = QLineEdit()
        self.camera.setFont(font("body"))
        self.camera.setMinimumHeight(40)
        self.camera.setMaxLength(CAMERA_LENGTH)
        self.camera.setPlaceholderText(USUAL)
        self.camera.setAccessibleName("Camera of conditions that show one")
        self.camera.editingFinished.connect(lambda: self.changed.emit("camera", self.camera.text().strip()))
        add_parts(self.column, _named("Camera of conditions that show one", self.camera), self.camera)

    def show_settings(self, settings: MachineSettings, folder: str) -> None:
        """Show what is set; ``folder`` is the workspace."""
        self.camera.setText(settings.camera)
        self.device.setCurrentIndex(self.device.findData(settings.device.partition(":")[0]))
        self.folder.show_text(folder)

    def _choose(self) -> None:
        chosen = QFileDialog.getExistingDirectory(self, "Workspace", self.folder.accessibleName())
        if chosen:
            self.changed.emit("workspace", chosen)


class WindowsCard(Card):
    """What the operator's windows look and sound like."""

    changed = Signal(str, object)

    def __init__(self) -> None:
        super().__init__("This program", gap=10)
        self.theme_choice = Choice()
        self.theme_choice.setFont(font("body"))
        self.theme_choice.setAccessibleName("Theme of the operator's windows")
        for name, words in (("light", "Light"), ("dark", "Dark")):
            self.theme_choice.addItem(words, name)
        self.sound = Toggle("Sound when a device needs attention")
        self.sound.setFont(font("body"))
        self.theme_choice.activated.connect(lambda _index: self.changed.emit("theme", self.theme_choice.currentData()))
        self.sound.clicked.connect(lambda on: self.changed.emit("sound", on))
        named = _named("Theme of the operator's windows", self.theme_choice)
        add_parts(self.column, named, self.theme_choice, self.sound)

    def show_settings(self, settings: MachineSettings) -> None:
        """Show what is set."""
        self.theme_choice.setCurrentIndex(self.theme_choice.findData(settings.theme))
        self.sound.setChecked(settings.sound)


def _named(name: str, field: QWidget) -> QLabel:
    made = label(name, "label", "text2")
    made.setBuddy(field)
    return made
