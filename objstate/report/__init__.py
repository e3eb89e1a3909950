"""Pictures for people: a result, or a batch, as one HTML page."""

from objstate.recording.batches import REPORT
from objstate.report.writing import write_batch_report, write_report

__all__ = ["REPORT", "write_batch_report", "write_report"]
