"""Tables of numbers in CSV, as benchmarks print them."""

import csv
from collections import namedtuple

from .results import BadInput


def read_rows(path, words, numbers):
    """The rows, with the columns `words` as text and `numbers` as floats by name. Raises BadInput, also for a number that
    is negative or not finite."""
    Row = namedtuple("Row", (*words, *numbers))
    rows = []
    try:
        with open(path, newline="") as file:
            for row in csv.DictReader(file):
                values = [float(row[name]) for name in numbers]
                if not all(0 <= value < float("inf") for value in values):
                    raise ValueError(f"a value is negative or not finite in {values}")
                rows.append(Row(*(row[name] for name in words), *values))
    except OSError as error:
        raise BadInput(f"{path}: cannot be read: {error.strerror}") from error
    except (KeyError, TypeError, ValueError, csv.Error) as error:
        raise BadInput(f"{path}: must have the columns {', '.join(Row._fields)} with numbers ({error})") from error
    if not rows:
        raise BadInput(f"{path}: has no rows")
    return rows
