"""The files of a study: journals, receipts, tables, recordings, sealed conditions, and their verification.

``files.folders`` defines where each file is, ``journals.journal_events`` which lines a journal may contain, and
``files.columns`` the columns of each table; read these first. ``sessions`` begins, reopens and rebuilds a session,
``session_progress`` computes how far it is, ``verification`` proves that no file was changed, and ``blinded`` controls
the conditions.

Reading order: files; journals, workstation; receipt, session_progress; blinded, integrity, support; exclusions,
recordings; merged, recorder; tables, versions; withdrawals; sessions, sites; unblinding, upgrade, verification.

Public modules: blinded, exclusions, files, integrity, journals.journal, journals.journal_events, merged, receipt,
recordings, session_progress, sessions, sites, support, tables, unblinding, upgrade, verification, versions,
withdrawals, workstation.
"""
