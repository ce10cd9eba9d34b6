"""A report for people: one page that opens anywhere, with its figures in it."""

from vision_s2r.diagnose.html.figures import figures
from vision_s2r.diagnose.html.page import write_html

__all__ = ["figures", "write_html"]
