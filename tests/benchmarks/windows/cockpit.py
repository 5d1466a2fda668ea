"""What the operator's live plots cost, and what they cost the servo: run me, I print two tables.

A refresh is a force and wake plot, a position plot and, each fifteenth time, the histogram of lateness, painted whole
at 1600 × 900 in software; times are of this thread alone, without what other programs take. Then the servo turns by
itself on a scripted hand, in turns without the cockpit and with it refreshed 30 times a second from the servo's own
telemetry: lateness with it is printed as a multiple of lateness without, from alternating stretches, so that what else
the machine does falls on both.
"""

import os
import statistics
import time

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import numpy as np
from PySide6.QtCore import QEventLoop, QTimer
from PySide6.QtWidgets import QApplication, QWidget

from study_app.devices.scripted import ScriptedDevice
from study_app.gui.operator import OperatorWindow
from study_app.gui.operator.force_plots import ForceCard
from study_app.haptics.model.layout import SAMPLE, records
from study_app.haptics.runtime.servo import Servo
from study_app.protocol.load import load
from study_app.viewmodels.force_traces import Forces
from study_app.viewmodels.servo_health import ServoHealth

LIMIT_N = 8.0
REFRESHES = 300
LIMIT_MS = 8.0
STRETCH_S = 3.0
STRETCHES = 8
TRACE_MS = 33
LATENESS_EVERY = 15


def window() -> OperatorWindow:
    """Return a shown cockpit of a single-blind study."""
    made = OperatorWindow("demo", lateness_limit_s=0.002, reach_m=0.05, pointer=False, force_limit_n=LIMIT_N)
    made.may_close = True
    made.show()
    QApplication.processEvents()
    return made


def lived() -> tuple[ServoHealth, Forces]:
    """Return a minute of ticks, and ten seconds of a hand that is pushed."""
    samples = records(SAMPLE, 60_000)
    samples.tick = np.arange(samples.size)
    samples.time_ns = samples.tick * 1_000_000
    samples.lateness_ns = np.random.default_rng(1).lognormal(9.5, 0.5, samples.size)
    samples.scene = 1
    turn = samples.tick / 300
    samples.device_force_n = np.column_stack((2 * np.sin(turn), np.cos(1.3 * turn), np.sin(0.7 * turn)))
    samples.wake_mps = 0.1 * samples.device_force_n
    health, forces = ServoHealth(1000.0), Forces(LIMIT_N)
    health.take(samples)
    forces.take(samples)
    for step in range(600):
        health.hand(48 + 0.02 * step, 0.02 * np.array((np.sin(step / 30), np.cos(step / 20), np.sin(step / 50))))
    return health, forces


def timed(*widgets: QWidget) -> float:
    """Return how long the widgets take to paint [ms, of this thread's own time]."""
    start = time.thread_time()
    for widget in widgets:
        widget.repaint()
    return 1e3 * (time.thread_time() - start)


def row(name: str, times_ms: list[float]) -> str:
    """Return a line of the table."""
    ordered = sorted(times_ms)
    p95 = ordered[round(0.95 * (len(ordered) - 1))]
    return f"{name:<36}{statistics.median(ordered):>9.2f}{p95:>9.2f}{ordered[-1]:>9.2f}"


def refreshes() -> None:
    """Print what one refresh of the plots takes."""
    operator = window()
    health, forces = lived()
    plots = (operator.force.plot, operator.force.wake) if isinstance(operator.force, ForceCard) else ()
    times: dict[str, list[float]] = {"placing": [], "position": [], "force and wake": [], "lateness": [], "all": []}
    for step in range(REFRESHES):
        now_s = 59.5 + step / 600
        start = time.thread_time()
        operator.show_traces(health, now_s)
        operator.show_forces(forces, round(now_s * 1e9))
        placing = 1e3 * (time.thread_time() - start)
        position = timed(operator.position.plot.viewport())
        force = timed(*(plot.viewport() for plot in plots))
        total = placing + position + force
        if step % LATENESS_EVERY == 0:
            start = time.thread_time()
            operator.show_lateness(health)
            lateness = 1e3 * (time.thread_time() - start) + timed(operator.lateness.plot.viewport())
            times["lateness"].append(lateness)
            total += lateness
        for name, spent in (("placing", placing), ("position", position), ("force and wake", force), ("all", total)):
            times[name].append(spent)
    operator.close()
    print(f"a refresh of the plots, {REFRESHES} of them [ms]")
    print(f"{'':<36}{'median':>9}{'p95':>9}{'most':>9}")
    for name, label in (
        ("placing", "placing the points"),
        ("position", "painting the position"),
        ("force and wake", "painting force and wake"),
        ("lateness", "placing and painting the lateness"),
        ("all", "whole refresh"),
    ):
        print(row(label, times[name]))
    print(f"limit for a whole refresh {LIMIT_MS:g} ms; {statistics.median(times['all']) / LIMIT_MS:.2f} of it")


def stretch(servo: Servo, operator: OperatorWindow | None) -> np.ndarray:
    """Let the servo turn for a while, with the cockpit refreshed or nothing shown; return lateness [µs] (n,)."""
    telemetry = servo.telemetry.reader()
    reader = servo.telemetry.reader()
    health, forces = ServoHealth(servo.rate_hz), Forces(LIMIT_N)
    count = 0

    def refresh() -> None:
        nonlocal count
        if operator is None:
            return
        samples = telemetry.read()
        health.take(samples)
        forces.take(samples)
        now_ns = servo.now_ns()
        health.hand(now_ns * 1e-9, servo.telemetry.position_at(now_ns)[0])
        operator.show_traces(health, now_ns * 1e-9)
        operator.show_forces(forces, now_ns)
        if count % LATENESS_EVERY == 0:
            operator.show_lateness(health)
        count += 1

    loop, timer = QEventLoop(), QTimer()
    timer.timeout.connect(refresh)
    timer.start(TRACE_MS)
    QTimer.singleShot(round(STRETCH_S * 1000), loop.quit)
    loop.exec()
    timer.stop()
    return np.asarray(reader.read().lateness_ns) / 1000


def lateness() -> None:
    """Print how late the servo is with the cockpit, as a multiple of without."""
    protocol = load("demo")
    device = ScriptedDevice()
    t_s = np.arange(0, 120, 0.005)
    operator = window()
    with device, Servo(device, elements=2000) as servo:
        device.follow(t_s, np.column_stack((0.03 * np.sin(6 * t_s), 0 * t_s, 0 * t_s)))
        servo.load(protocol.scene_for("thin"))
        without: list[np.ndarray] = []
        shown: list[np.ndarray] = []
        for _ in range(STRETCHES):
            without.append(stretch(servo, None))
            shown.append(stretch(servo, operator))
        priority = servo.describe()["priority"]
    operator.close()
    print(f"\nlateness of the servo, {STRETCHES} stretches of {STRETCH_S:g} s each way, priority {priority}")
    print(f"{'':<36}{'without':>9}{'with':>9}{'ratio':>9}")
    for name, percent in (("median", 50), ("p99", 99), ("p99.9", 99.9)):
        off, on = (float(np.median([np.percentile(one, percent) for one in of])) for of in (without, shown))
        print(f"{name + ' [µs], median of stretches':<36}{off:>9.1f}{on:>9.1f}{on / off:>9.2f}")


def main() -> None:
    """Measure and print."""
    application = QApplication.instance() or QApplication([])
    refreshes()
    lateness()
    application.processEvents()


if __name__ == "__main__":
    main()
