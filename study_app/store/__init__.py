"""Keeping what happened: journal, receipt, derived tables, recordings, sealed conditions; and proving it.

begin a session: ``session``; while it runs: ``open_session``, ``journal``, ``recorder``; afterwards: ``progress``,
``resume``, ``rebuild``, ``verify``, ``exclusions``, ``blinding``; what files hold: ``layout``, ``columns``, ``events``,
``recording``, ``receipt``, ``checksums``, ``dictionary``.
"""
