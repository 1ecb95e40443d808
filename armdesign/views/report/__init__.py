"""A finished run as one HTML page that needs no network, and as a PDF where a browser is there to print it."""

from __future__ import annotations

from armdesign.views.report.pdf import find_browser, print_pdf
from armdesign.views.report.report_page import report_html

__all__ = ["find_browser", "print_pdf", "report_html"]
