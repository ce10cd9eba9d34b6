"""A report for people: one page that opens anywhere, with its figures in it."""

from vision_s2r.report.figures import figures
from vision_s2r.report.gap_report import GapReport
from vision_s2r.report.page import write_html

__all__ = ["GapReport", "figures", "write_html"]
