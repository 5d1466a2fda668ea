"""Merged studies: the results folders of several sites of one protocol, kept as they are next to each other."""

from study_app.store.sites.merge import damaged_sessions, merge_sites

__all__ = ["damaged_sessions", "merge_sites"]
