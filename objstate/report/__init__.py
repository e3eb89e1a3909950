"""Pictures for people: a result, or a batch, as one HTML page."""

from objstate.report.writing import REPORT, write_batch_report, write_report

__all__ = ["REPORT", "write_batch_report", "write_report"]
