"""Result folders as one page: what was found, what failed, and the commands that repeat it."""

from pbcs_ompl.results.report.page import Report, write_report

__all__ = ["Report", "write_report"]
