"""The statistic of a grid question: the mean place, column and row."""

from study_app.analysis.questions import Measure, counts_of_missing, given_answers


def places(_asked, answers):
    """Return the numbers of a group of answers: rows with ``response``, ``participant`` and ``cannot_judge``."""
    found = [tuple(map(int, str(one).split())) for one in given_answers(answers)["response"]]
    means = [sum(one) / len(found) for one in zip(*found, strict=True)] or [None, None]
    return {**counts_of_missing(answers), "column": means[0], "row": means[1]}


def cells(_asked, numbers):
    """Return the cells of a row of the report's table, by heading."""
    column, row = ("–" if mean is None else f"{mean:.2f}" for mean in (numbers["column"], numbers["row"]))
    return {"n": str(numbers["n"]), "mean column": column, "mean row": row}


PLACES = Measure("liquid_study_template.question_measure:PLACES", places, cells)
