"""The preview: arms performing their tasks in MeshCat, as one page that needs nothing from elsewhere."""

from __future__ import annotations

from armdesign.views.preview.preview_page import check_speed, preview_html
from armdesign.views.preview.server import PageServer

__all__ = ["PageServer", "check_speed", "preview_html"]
