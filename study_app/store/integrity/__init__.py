"""Checksums of a session, and locks of folders."""

from study_app.store.integrity.checksums import checked_line, place_of, read_list, sha256
from study_app.store.integrity.folder_lock import is_never_begun, is_open

__all__ = ["checked_line", "is_never_begun", "is_open", "place_of", "read_list", "sha256"]
