from study_app.authoring.writer.comments import comments_naming

TEXT = '''# "honey" first
a = "# `honey` in a string"  # the [honey, water]
b = """
# `honey` in a text
"""
c = 'honey'  # `honey_2`, "honeyed" and the honey's smell
d = 1  # more of liquids.honey.\r
# The late_60 condition; honey = thick, late_600 and liquids.late_60
# Honey and honey are common words.
'''


def test_comments_are_found_by_whole_names_and_strings_are_none() -> None:
    lines = TEXT.splitlines()
    found = comments_naming(TEXT, "honey")
    assert [comment.line for comment in found] == [1, 2, 7, 8]
    assert found[0].text == lines[0]
    assert found[2].text == "# more of liquids.honey."
    assert [comment.line for comment in comments_naming(TEXT, "late_60")] == [8]
    assert comments_naming(TEXT, "x") == ()
    assert comments_naming(TEXT, "common") == ()  # a plain word of the language names nothing
