"""Make the picture of an arm in its cell from a run folder, as the report begins with it.

``python docs/make_cell_picture.py RUN PICTURE.png``
"""

from __future__ import annotations

import base64
import re
import sys
from pathlib import Path

from armdesign.runs.reading import read_result
from armdesign.views.report.cell_rendering import cell_rendering


def main() -> None:
    """Write the PNG that the report's first picture holds."""
    run, picture = map(Path, sys.argv[1:3])
    found = re.search(r"base64,([^\"]*)", cell_rendering(read_result(run)).svg)
    if found is None:
        raise SystemExit("the report's picture holds no PNG any more: this script has to change with it")
    picture.write_bytes(base64.b64decode(found.group(1)))


if __name__ == "__main__":
    main()
