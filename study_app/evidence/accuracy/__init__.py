"""Accuracy over computation time: models compared with independently computed references."""

from study_app.evidence.accuracy.accuracy_report import accuracy_evidence
from study_app.evidence.accuracy.comparison import accuracy
from study_app.evidence.accuracy.survey import survey_evidence, survey_scenes

__all__ = ["accuracy", "accuracy_evidence", "survey_evidence", "survey_scenes"]
