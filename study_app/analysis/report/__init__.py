"""The report: findings in words, tables and figures, with everything needed to check them.

Reading order: methods, questions_in_full; sections, study_figures; first_page; write_report.
"""
