"""Analysis of results folders, never of a live session.

``data.study_tables`` reads a folder into one ``Study``, ``evaluate`` computes all results of it, and
``findings.finding`` is the base of what a report states; read these first. ``levels`` analyses blocks with a design,
``planning`` simulates studies that do not exist yet.

Reading order: wording, worker_messages; statistics; data; results; page_layout, questions; html_page; levels; export,
figures; findings; contrasts; evaluate; planned_exclusions; planning; report; export_study; study_worker.

Public modules: contrasts, data, evaluate, export, export_study, findings, levels.exponents, levels.thresholds,
levels.tracks, planned_exclusions, planning, planning.power_curves, planning.power_estimates, planning.preregistration,
planning.simulated_studies, planning.threshold_studies, report, results, statistics, worker_messages.
"""
