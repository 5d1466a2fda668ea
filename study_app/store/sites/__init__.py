"""Merged studies: the results folders of several sites of one protocol, kept as they are next to each other."""

from study_app.store.sites.merge import merge_sites

__all__ = ["merge_sites"]
