from __future__ import annotations

from study_app.authoring.writer.comments import comments_naming

TEXT = '''# honey first
a = "# honey in a string"  # the honey
b = """
# honey in a text
"""
c = 'honey'  # honey_2, honeyed and liquids.honey
d = 1  # more honey.\r
'''


def test_comments_are_found_by_whole_names_and_strings_are_none() -> None:
    assert comments_naming(TEXT, "honey") == (
        (1, "# honey first"), (2, "# the honey"), (7, "# more honey.")
    )  # fmt: skip
    assert comments_naming(TEXT, "x") == ()
