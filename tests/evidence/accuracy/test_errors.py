"""Errors of forces and their Pareto front."""

import math
from collections import namedtuple

import numpy as np
import pytest
from matplotlib.figure import Figure

from study_app.evidence.accuracy import accuracy_report
from study_app.evidence.accuracy.comparison import Accuracy, ActingError, Row, Time, pareto_front
from study_app.evidence.reference_solutions import Case, Error, Truth, error_of
from study_app.haptics.model.motion import Motion

pytestmark = pytest.mark.slow

Candidate = namedtuple("Candidate", "name rate_hz")


def one_case(*force_n):
    force = np.array(force_n, float)
    motion = Motion(np.arange(len(force)) / 1000, np.zeros_like(force))
    return Truth(name="one", source="", cases=(Case(motion, force, np.array([True] * (len(force) - 1) + [False])),))


def test_errors_are_of_the_rows_that_count_and_shares_of_the_true_force():
    error = error_of([np.array([[1.0, 0, 0], [0, 2.5, 0], [9, 9, 9]])], one_case((2, 0, 0), (0, 2, 0), (0, 0, 0)))
    assert error.rms_n == pytest.approx(math.sqrt((1 + 0.25) / 2))
    assert error.most_n == 1
    assert error.rms == pytest.approx(error.rms_n / 2)
    assert error.most == 0.5
    assert error.direction_deg == 0
    assert error.target == 0.05


def test_direction_counts_where_the_force_is_felt():
    truth = one_case((2, 0, 0), (0.04, 0, 0), (0, 0, 0))
    error = error_of([np.array([[0, 1.0, 0], [-1, 0, 0], [0, 0, 0]])], truth)
    assert error.direction_deg == pytest.approx(90)
    weak = error_of(
        [np.array([[1e-3, 0, 0], [0, 1e-3, 0], [0, 0, 0]])], one_case((1e-3, 0, 0), (1e-3, 0, 0), (0, 0, 0))
    )
    assert weak.direction_deg == pytest.approx(math.sqrt(90**2 / 2))
    assert weak.target == pytest.approx(50)


def test_the_front_takes_rounding_errors_and_times_within_a_twentieth_as_equal():
    def row(name, ns, rms):
        candidate = Candidate(name, 1000.0)
        return candidate, Row(
            "numerical",
            "water",
            "t",
            candidate,
            Error(rms_n=0, most_n=0, rms=rms, most=0, direction_deg=0, target=0.05),
            Time(ns, ns, 1),
            1,
            chosen=False,
        )

    points = dict([row("quick", 10, 0.5), row("dear", 20, 0.6), row("sums", 30, 1e-13), row("list", 900, 1e-16)])
    assert [candidate.name for candidate in pareto_front(points)] == ["quick", "sums"]
    alike = dict([row("quick", 100, 0.5), row("truer", 104, 0.1), row("truest", 150, 0.01)])
    assert [candidate.name for candidate in pareto_front(alike)] == ["truer", "truest"]


def test_each_estimator_is_drawn_at_its_time_and_errors_with_their_axes_named() -> None:
    errors = [("ewma", 1, 21.0, 40.0, 11.0), ("ewma", 3, 25.0, 90.0, 30.0), ("kalman", 2, 63.0, 17.0, 13.0)]
    acting = tuple(ActingError(*row) for row in errors)
    table = Accuracy(rows=(), truths=(), notes=(), machine="", motion="", acting=acting, acting_liquid="Water")
    figure = Figure(figsize=(6, 4))
    accuracy_report._draw_acting(figure, table, 288.0)
    (axes,) = figure.axes
    assert (axes.get_xlabel(), axes.get_title()) == ("Computation time per tick [ns]", "Error [% of the force]")
    places = [tuple(part.get_offsets()[0]) for part in axes.collections]
    assert places == [(23, 40), (23, 11), (23, 90), (23, 30), (63, 17), (63, 13)]
    texts = {text.get_text(): text.xy for text in axes.texts}
    assert texts == {"1": (23, 40), "3": (23, 90), "2": (63, 17), "ewma": (23, 60), "kalman": (63, 17)}
    (low, high), (left, right) = axes.get_ylim(), axes.get_xlim()
    assert (low < 11, high > 90, left < 21, right > 63) == (True, True, True, True)
