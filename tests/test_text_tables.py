"""Tables written by instruments and spreadsheets: read if unambiguous, otherwise refused by line."""

import pytest

from study_app.text_tables import decoded, rows_of, split

NAMES = ("rate", "stress")
POINTS = [[0.1, 21.558], [2.5, 28.6], [100.0, 60.0]]


def read(content: bytes) -> list[list[float]]:
    table = split(decoded(content), NAMES, comment="#")
    return rows_of(table, [table.names.index(name) for name in NAMES])


@pytest.mark.parametrize(
    "text",
    [
        "rate,stress\n0.1,21.558\n2.5,28.6\n100,60\n",
        "\ufeffrate,stress\r\n0.1,21.558\r\n2.5,28.6\r\n100,60\r\n",
        "rate,stress\r0.1,21.558\r2.5,28.6\r100,60",
        "rate;stress\n0.1;21.558\n2.5;28.6\n100;60\n",
        "rate;stress\n0,1;21,558\n2,5;28,6\n100;60\n",
        "rate\tstress\n0,1\t21,558\n2,5\t28,6\n100\t60\n",
        'rate,stress\n"0,1","21,558"\n"2,5","28,6"\n"100","60"\n',
        "rate;stress\n1E-1;2,1558e1\n2,5;28,6\n1,00e+2;60\n",
        "# rheometer\nrate , stress\n\n0.1, 21.558\n 2.5,28.6\n100,60\n\n",
        "rate,stress,,\n0.1,21.558,,\n2.5,28.6,,\n100,60,,\n,,,\n",
        "rate,stress\n0.1,21.558,\n2.5,28.6,,\n100,60\n",
        'sample,stress,rate\n"thick, warm",21.558,0.1\n"1,5",28.6,2.5\nthin,60,100\n',
    ],
    ids=[
        "commas", "mark", "carriage returns", "semicolons", "decimal commas", "tabs", "quoted decimal commas",
        "exponents", "comments and spaces", "empty columns", "empty fields at the end", "texts with commas",
    ],
)  # fmt: skip
def test_a_table_with_one_reading_is_read(text: str) -> None:
    assert read(text.encode()) == POINTS


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"rate,stress\n1,5,26,7\n", "line 2: has 4 fields, more than the 2 in the header: write decimal points"),
        (b"rate,stress\n0.1,21\n2,5,28.6\n", "line 3: has 3 fields, more than the 2 in the header: remove the extra"),
        (b"rate;stress\n0.1;21\n\n2.5\n", "line 4: has 1 field, fewer than the 2 in the header"),
        (b"rate,stress,note\n0.1,21\n", "line 2: has 2 fields, fewer than the 3 in the header"),
        (b"rate;stress\n1,234;5,678\n", "line 2: “1,234” can be read as 1.234 or 1234: write 1.234 or 1234"),
        (b"rate;stress\n0.1;21\n2,5;28\n", "line 2: '0.1' has a decimal point, but '2,5' in line 3 has a"),
        (
            b"rate,stress\n1/s,Pa\n0.1,21\n",
            "line 2 does not contain a number ('1/s', 'Pa'): if it is a row of units, remove it",
        ),
        (b'rate,stress\n0.1,21\n2.5,"1,2,3"\n', "line 3: '1,2,3' is not a finite number; write a decimal point"),
        (b"rate,stress\n0.1,21\nnan,3\n", "line 3: 'nan' is not a finite number; correct it or remove"),
        (b"rate,stress\n0.1,21\n1_0,3\n", "line 3: '1_0' is not a finite number"),
        (b'rate,stress\n0.1,"21\n', "line 2 is not valid CSV"),
        ("rate,stress\n0.1,21\n".encode("utf-16"), "it is not UTF-8 text but seems to be UTF-16: save it as CSV"),
        ("rate,stress\n0.1,21\n".encode("utf-16-le"), "it is not UTF-8 text but seems to be UTF-16: save it as CSV"),
        (b"rate,stress\n0.1,21\n# 20 \xb0C\n", "it is not UTF-8 text in line 3: save it as CSV in UTF-8"),
    ],
)
def test_other_tables_are_refused_with_their_first_line(content: bytes, said: str) -> None:
    with pytest.raises(ValueError) as refusal:  # noqa: PT011 - the sentence is compared
        read(content)
    assert str(refusal.value).startswith(said)
    assert "\n" not in str(refusal.value)
