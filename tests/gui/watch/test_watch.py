"""The window that replays a trial: compared with its recording, blinded, damaged, exported."""

import shutil
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QColor, QImage
from PySide6.QtWidgets import QLabel, QWidget

from study_app.gui.sessions.session_facts import sessions
from study_app.gui.sessions.session_page import SessionPage
from study_app.gui.theme.theme import DARK
from study_app.gui.watch.window import _TimeLine
from study_app.protocol.load import load
from study_app.session.simulated.rehearsal import rehearse
from study_app.session.watch import _mark_text
from study_app.store import recordings
from study_app.store.unblinding import unblind
from tests.compiled import needs_servo
from tests.gui.walk import cut, dead, settle, unnamed, unreached
from tests.journal_lines import event_of
from tests.protocol.trials import level_studies

pytestmark = [pytest.mark.slow, needs_servo]

ROW, TRIAL = 2, "recordings/trial-003.parquet"


@pytest.fixture(scope="module")
def sealed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sealed") / "demo"
    rehearse("demo", participants=1, seed=1, results=folder)
    return folder


@pytest.fixture(scope="module")
def whole(sealed, tmp_path_factory):
    folder = Path(shutil.copytree(sealed, tmp_path_factory.mktemp("whole") / "demo"))
    unblind(folder, by="AK", reason="over")
    return folder


@pytest.fixture
def open_trial(qtbot):
    """Return a function that opens a trial of a study by a click on its session's page."""
    windows = []

    def open_trial(study, row=ROW):
        below = QWidget()
        qtbot.addWidget(below)
        page = SessionPage(below, DARK, next(iter(sessions(study.parent, {}))), print)
        qtbot.addWidget(page)
        page.show()
        qtbot.waitUntil(lambda: page.record is not None)
        page.trials.selectRow(row)
        qtbot.mouseClick(page.watch, Qt.MouseButton.LeftButton)
        window = page.watched
        windows.append((below, window))
        qtbot.waitUntil(lambda: window.stage is not None or window.sentence.text() != "Reading…")
        return window

    yield open_trial
    for _, window in windows:
        for widget in filter(None, (window.export_dialog, window)):
            widget.close()


def recorded(study, name=TRIAL):
    """Return a recording's samples and the times since its task began [s], read without the program's window."""
    samples = recordings.read_samples(study / "data" / "sub-P001" / "ses-01" / name)
    own = samples.time_ns[samples.scene == samples.scene[-1]]
    return samples, (samples.time_ns - own[0]) * 1e-9


def visible_text(window):
    return " | ".join(part.text() for part in window.findChildren(QLabel) if part.isVisible())


def test_every_moment_is_the_recordings(open_trial, whole):
    window = open_trial(whole)
    samples, times_s = recorded(whole)
    stage = window.stage
    for at in (0, 700, 3000, len(samples) - 1):
        window.go(float(times_s[at]))
        place = stage.tank.placer.place(tuple(samples.position_m[at]))
        assert (stage.tank.ball.middle.x(), stage.tank.ball.middle.y()) == pytest.approx(
            (place.middle.x(), place.middle.y()), abs=1e-3
        )
        sent, requested = (np.linalg.norm(samples[name][at]) for name in ("device_force_n", "force_n"))
        for words in (
            f"{times_s[at]:.3f} s",
            f"sample {at + 1} ",
            f"sent {sent:.3f} N",
            f"requested {requested:.3f} N",
        ):
            assert words in f"{stage.numbers.text()} "
        force = next((arrow for arrow in stage.tank.arrows if arrow.name == "force"), None)
        assert np.cross(force.vector_m, samples.device_force_n[at]) == pytest.approx(0, abs=1e-9)
        assert stage.forces.cursor.value() == pytest.approx(times_s[at])
    assert stage.forces.sent.yData.max() == pytest.approx(np.linalg.norm(samples.device_force_n, axis=1).max())
    targets = [mark.text for mark in stage.shown.marks if mark.kind == "target"]
    count = len(stage.shown.page.task.targets_m)
    assert targets == [f"target {number % count + 1} reached" for number in range(len(targets))]
    assert len(targets) > count
    answers = [mark.text for mark in stage.shown.marks if mark.kind == "answer"]
    assert answers[-1] == "answers confirmed"
    assert {text.split(":")[0] for text in answers[:-1]} == {"harder", "comfortable"}
    window.go(stage.shown.marks[1].at_s + 0.001)
    assert stage.happened.whole.endswith("target 2 reached")
    assert stage.tank.view.task.reached == 2


@pytest.mark.parametrize(
    ("event", "fields", "mark"),
    [
        ("target_reached", {"target": 2}, ("target", "target 3 reached")),
        ("stepped", {"steps": -1}, ("answer", "set -1 step")),
        ("choice", {"item": "thick", "value": None}, ("answer", "thick: cannot judge")),
        ("trial_ended", {"outcome": "timeout"}, ("event", "task ended: timeout")),
        ("note", {"text": ""}, ("event", "note: marked")),
    ],
)
def test_each_line_of_the_journal_has_its_mark(event, fields, mark):
    assert _mark_text(event_of(event, **fields)) == mark


def test_the_time_line_marks_each_event_in_its_colour(qtbot):
    moments = {"target": 2.0, "answer": 5.0, "event": 8.0}
    marks = [SimpleNamespace(kind=kind, at_s=at_s) for kind, at_s in moments.items()]
    line = _TimeLine(SimpleNamespace(begins_s=0.0, ends_s=10.0, marks=marks))
    qtbot.addWidget(line)
    line.resize(400, 40)
    line.show_time(0.0)
    image = line.grab().toImage()
    drawn = [image.pixelColor(round(line._position_of(at_s)), 6).name() for at_s in moments.values()]
    assert drawn == [QColor(ink).name() for ink in (line.theme.ok, line.theme.accent, line.theme.text2)]


def test_keys_mouse_and_speed_move_through_time(open_trial, whole, qtbot, monkeypatch):
    window = open_trial(whole)
    stage, (_, times_s) = window.stage, recorded(whole)
    clock = [100.0]
    monkeypatch.setattr("study_app.gui.watch.window.time.perf_counter", lambda: clock[0])

    def press(*keys):
        for key in keys:
            qtbot.keyClick(stage.line, key)

    window.go(1.0)
    press(Qt.Key.Key_Right)
    frame_s = stage.at_s
    assert frame_s == stage.shown.painted_s[stage.shown.painted_s > 1.0][0]
    press(Qt.Key.Key_Period, Qt.Key.Key_Period)
    assert stage.at_s == times_s[times_s > frame_s][1]
    press(Qt.Key.Key_Comma, Qt.Key.Key_Comma, Qt.Key.Key_Left)
    assert stage.at_s == pytest.approx(stage.shown.painted_s[stage.shown.painted_s <= frame_s][-1], abs=0.02)
    for speed in (0.1, 1.0, 4.0):
        window.speed.setCurrentIndex(window.speed.findData(speed))
        window.go(2.0)
        press(Qt.Key.Key_Space)
        assert window.playing
        clock[0] += 0.5
        qtbot.waitUntil(lambda speed=speed: stage.at_s == pytest.approx(2.0 + 0.5 * speed))
        assert window.play.text() == "Pause"
        if speed == 1.0:  # a quarter of a second at another speed follows without a jump
            window.speed.setCurrentIndex(window.speed.findText("2×"))
            window.speed.activated.emit(window.speed.currentIndex())
            clock[0] += 0.25
            qtbot.waitUntil(lambda: stage.at_s > 2.6)
            assert stage.at_s == pytest.approx(3.0)
        qtbot.mouseClick(window.play, Qt.MouseButton.LeftButton)
        assert (window.playing, window.play.text()) == (False, "Play")
    clock[0] += 100.0
    assert stage.at_s == pytest.approx(4.0), "a pause does not count"
    middle = stage.line.rect().center()
    qtbot.mousePress(stage.line, Qt.MouseButton.LeftButton, pos=QPoint(20, middle.y()))
    qtbot.mouseMove(stage.line, middle)
    assert stage.at_s == pytest.approx((stage.shown.begins_s + stage.shown.ends_s) / 2, abs=0.1)
    assert stage.line.accessibleDescription().startswith(f"{stage.at_s:.3f} s")
    press(Qt.Key.Key_End, Qt.Key.Key_Space)
    assert (window.playing, stage.at_s) == (True, stage.shown.begins_s)


def test_the_ball_is_as_late_as_on_the_screen(open_trial, whole, qtbot):
    window = next(
        candidate for candidate in (open_trial(whole, row) for row in (2, 3)) if candidate.presented.word == "late"
    )
    window.go(2.0)
    assert window.seen.toolTip().startswith("Shows the ball with the delay that the participant saw;")
    hand_ns = window.stage.tank.view.sample_time_ns
    window.seen.click()
    assert (hand_ns - window.stage.tank.view.sample_time_ns) * 1e-9 == pytest.approx(0.15, abs=0.1)


@pytest.mark.parametrize(
    ("harm", "words"),
    [
        (lambda file: file.write_bytes(b"PAR1" + file.read_bytes()[:400]), "is damaged"),
        (lambda file: file.unlink(), "restore"),
        (None, "is sealed until the study is unblinded: run liquid-study unblind"),
    ],
)
def test_an_unreadable_recording_is_reported_in_one_line(open_trial, sealed, whole, tmp_path, harm, words):
    study = Path(shutil.copytree(whole if harm else sealed, tmp_path / "results" / "demo"))
    if harm:
        harm(study / "data" / "sub-P001" / "ses-01" / TRIAL)
    window = open_trial(study)
    assert words in window.sentence.text()
    assert "\n" not in window.sentence.text()
    assert not any(part.isEnabled() for part in (window.play, window.export, window.speed, *window.steps.values()))
    assert "thick" not in visible_text(window)


def test_a_trial_without_frames_is_shown_with_a_line_about_the_missing_file(open_trial, whole, tmp_path):
    study = Path(shutil.copytree(whole, tmp_path / "results" / "demo"))
    (frames,) = (study / "data" / "sub-P001" / "ses-01").glob(TRIAL.replace(".parquet", "*frames*"))
    frames.unlink()
    window = open_trial(study)
    assert window.stage.forces.sent.yData.max() > 0.1
    assert (window.lacking.isVisible(), window.seen.isVisible()) == (True, False)
    assert window.lacking.text().startswith(f"The frames of the participant's screen are missing: {frames}")
    assert "\n" not in window.lacking.text()
    window.step("frame", 1)
    assert window.stage.at_s > window.stage.shown.begins_s


def test_while_the_study_is_blinded_nothing_tells_force_delay_or_condition(
    open_trial, sealed, whole, tmp_path, monkeypatch
):
    study = Path(shutil.copytree(sealed, tmp_path / "results" / "demo"))
    for file in (whole / "data").rglob("*.parquet"):  # as of an earlier version, whose recordings were not sealed
        shutil.copy(file, study / file.relative_to(whole))
    assert "the recorded motion would reveal the liquid" in open_trial(study).sentence.text()
    monkeypatch.setattr("study_app.session.watch.reason_motion_is_hidden", lambda *_: "")
    for row in range(4):
        window = open_trial(study, row)
        window.go(2.0)
        assert window.stage.forces is None
        assert [arrow.name for arrow in window.stage.tank.arrows] in ([], ["velocity"])
        assert (window.seen.isVisible(), len(window.stage.shown.painted_s)) == (False, 0)
        assert " N" not in visible_text(window)
        assert not [
            name for name in load("demo").conditions if name in f"{visible_text(window)} {window.presented.word}"
        ]
        assert window.presented.word == "Blinded: shown as a code"


def test_an_exported_video_shows_the_picture_of_the_window(open_trial, whole, qtbot, tmp_path):
    import av

    window = open_trial(whole)
    window.speed.setCurrentIndex(window.speed.findData(4.0))
    window.go(2.0)
    picture = window.stage.grab().toImage().convertToFormat(QImage.Format.Format_RGB32)  # kept: its bytes are compared
    window.export.click()
    sentence = "sub-P001_ses-01_trial-003.mp4 will show this view at 4× speed."
    assert sentence in [part.text() for part in window.export_dialog.findChildren(QLabel)]
    assert window.export_dialog.value("to") == str(whole.resolve().parent)
    window.export_dialog.editors["to"].show_value(str(tmp_path))
    qtbot.mouseClick(window.export_dialog.go_on, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: window.export_dialog.over, timeout=60_000)
    (file,) = tmp_path.iterdir()
    assert window.export_dialog.said.text() == f"The video was saved as {file}."
    assert (file.name, window.stage.at_s) == ("sub-P001_ses-01_trial-003.mp4", 2.0)
    with av.open(str(file)) as video:
        frames = [frame.to_ndarray(format="bgra") for frame in video.decode(video=0)]
    span_s = window.stage.shown.ends_s - window.stage.shown.begins_s
    assert len(frames) == int(np.ceil(span_s * 30 / 4))
    near = frames[round((2.0 - window.stage.shown.begins_s) * 30 / 4)]
    pixels = np.frombuffer(picture.constBits(), np.uint8).reshape(picture.height(), -1, 4)
    window_pixels = pixels[: near.shape[0], : near.shape[1]]
    assert np.abs(near[..., :3].astype(int) - window_pixels[..., :3]).mean() < 3


def test_without_the_extra_the_export_names_the_package(open_trial, whole, qtbot, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "av", None)
    window = open_trial(whole)
    window.export.click()
    window.export_dialog.editors["to"].show_value(str(tmp_path))
    qtbot.mouseClick(window.export_dialog.go_on, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: "liquid-study[video]" in window.export_dialog.said.text())
    assert list(tmp_path.iterdir()) == []


def test_intervals_are_chosen_and_nothing_is_cut(open_trial, tmp_path, qtbot):
    source = tmp_path / "levels.toml"
    source.write_text(level_studies.text_of(*level_studies.SHORT), encoding="utf-8", newline="\n")
    study = tmp_path / "results" / "levels"
    rehearse(str(source), participants=1, seed=1, results=study)
    unblind(study, by="AK", reason="over")
    window = open_trial(study, 0)
    first, presented = window.stage, {window.presented.word}
    assert window.interval.count() == first.shown.page.interval.of == 2
    window.interval.activated.emit(1)
    qtbot.waitUntil(lambda: window.stage is not None and window.stage is not first)
    assert presented | {window.presented.word} == {"standard", "comparison"}
    assert window.stage.shown.page.interval.number == 2
    for size in ((window.minimumSizeHint().width(), 560), (984, 580), (1366, 768), (1880, 1020)):
        settle(window, size)
        assert cut(window) == []
        assert window.size().toTuple() == size
    assert unnamed(window) == unreached(window) == dead(window) == []
