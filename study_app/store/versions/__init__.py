"""The contents of a study's file: drafts, saved versions, and those with which sessions were run."""

from study_app.store.versions.drafts import Draft, Keeper, draft_files, draft_of, drafted_files, unsaved_files
from study_app.store.versions.study_runs import (
    RecordedContent,
    Run,
    content_changes,
    keep_run_content,
    recorded_contents,
    recorded_items,
    run_of,
    runs_of_study,
    source_of,
)
from study_app.store.versions.study_settings import keep_original, kept_original
from study_app.store.versions.study_versions import (
    ChangedOutsideError,
    Kept,
    content_hash,
    keep_content,
    kept_content,
    kept_versions,
    save_study,
    write_whole,
)

__all__ = [
    "ChangedOutsideError",
    "Draft",
    "Keeper",
    "Kept",
    "RecordedContent",
    "Run",
    "content_changes",
    "content_hash",
    "draft_files",
    "draft_of",
    "drafted_files",
    "keep_content",
    "keep_original",
    "keep_run_content",
    "kept_content",
    "kept_original",
    "kept_versions",
    "recorded_contents",
    "recorded_items",
    "run_of",
    "runs_of_study",
    "save_study",
    "source_of",
    "unsaved_files",
    "write_whole",
]
