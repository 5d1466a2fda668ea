"""Keeping what happened: journal, receipt, derived tables, recordings, sealed conditions; and proving it.

begin a session: ``session``; while it runs: ``open_session``, ``journal``, ``recorder``; afterwards: ``progress``,
``resume``, ``rebuild``, ``verify``, ``exclusions``; who may know the conditions: ``blinding``, ``sealing``,
``unblinding``; what files hold: ``layout``, ``columns``, ``events``, ``recording``, ``receipt``, ``checksums``,
``dictionary``.
"""
