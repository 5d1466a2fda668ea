"""The page of a new study: templates, copies of studies, and the questions that it begins with."""

from study_app.designer.new_study.new_study_page import NewStudyPage, NoStudyCard

__all__ = ["NewStudyPage", "NoStudyCard"]
