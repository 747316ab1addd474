"""Result folders as one page: what came out, what failed, and the commands that repeat it."""

from pbcs_ompl.results.report.page import write_report

__all__ = ["write_report"]
