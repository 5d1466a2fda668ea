"""Merged studies: unchanged copies of the results folders of several sites that ran the same protocol."""

from study_app.store.sites.merge import damaged_sessions, merge_sites

__all__ = ["damaged_sessions", "merge_sites"]
