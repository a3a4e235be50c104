"""What every estimator keeps of each of its inputs, to predict one that is missing."""

from ...engine.layout import Field, each


def each_input(size: str = "inputs") -> list[Field]:
    """Return the fields of a row that hold the inputs, so many of them."""
    return each(
        size,
        held="each input: its value, predicted while missing",
        input_variance="variance of that prediction",
        known="how many values are known",
        sums="sum of them",
        squares="of their squares",
        steps="of their squared steps",
    )
