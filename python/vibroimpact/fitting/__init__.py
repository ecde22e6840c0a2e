"""From a record of a motion to the numbers of the machine, with their errors."""

from .call import expected_errors, fit
from .determined import ExpectedErrors
from .measuring import measure
from .record import Record
from .result import Fit

__all__ = ["ExpectedErrors", "Fit", "Record", "expected_errors", "fit", "measure"]
