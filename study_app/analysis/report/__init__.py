"""The report: findings in words, tables and figures, with everything needed to check them.

Reading order: practice_and_breaks; methods, questions_in_full, r_script, background_table, motion_section; sections,
study_figures; first_page; write_report.
"""

from study_app.analysis.report.sections import answers
from study_app.analysis.report.study_figures import plot
from study_app.analysis.report.write_report import report

__all__ = ["answers", "plot", "report"]
