"""Pictures for people: a result as one HTML page."""

from objstate.report.writing import REPORT, write_report

__all__ = ["REPORT", "write_report"]
