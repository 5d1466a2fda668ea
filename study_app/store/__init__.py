"""The files of a study: journals, receipts, tables, recordings, sealed conditions, and their verification.

``folders`` knows where each file is, ``journals.journal_events`` what a line of the journal may hold, and
``columns`` what a table has; read these first. ``sessions`` begins, reopens and rebuilds a session, ``progress``
computes how far one is, ``verification`` proves that files were not changed, ``blinded`` controls the conditions.

Reading order: atomic, delivered, folders, missing_trials, program_log; csv_files, output_files, workstation;
columns; journals; checksums, progress, receipt; blinded, folder_lock, support; exclusions, recordings,
study_versions; drafts, merged, recorder, study_settings; study_runs, tables; withdrawals; sessions, sites;
unblinding, upgrade, verification.

Public modules: atomic, blinded.allocation, blinded.blinding, blinded.sealing, checksums, columns, csv_files, delivered,
drafts, exclusions, folder_lock, folders, journals.journal, journals.journal_events, merged, missing_trials,
output_files, program_log, progress, receipt, recorder, recordings, sessions.begin, sessions.open_session,
sessions.recovery, sessions.simulated_sessions, sites.merge, study_runs, study_settings, study_versions, support,
tables.column_dictionary, tables.session_tables, tables.study_files, unblinding, upgrade, verification.leaks,
verification.proofs, verification.recorded_streams, verification.reproduction, verification.verify_session,
verification.verify_study, withdrawals, workstation.
"""
