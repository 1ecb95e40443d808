"""Where the URDF templates are, and how they are filled in."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import jinja2

from armdesign.errors import ArmDesignError

FOLDER = "urdf_templates"
PACKAGE = Path(__file__).resolve().parent.parent


def template_path(name: str, package: Path = PACKAGE) -> Path:
    """Find a template: inside the package (a wheel) or beside it (a checkout or an editable install).

    Args:
        name: File name of the template.
        package: Folder of the package.

    Raises:
        ArmDesignError: It is in neither place.
    """
    places = [package / FOLDER / name, package.parent / FOLDER / name]
    for place in places:
        if place.is_file():
            return place
    raise ArmDesignError(
        f"the template '{name}' is missing; looked for {places[0]} and {places[1]}",
        value=name,
        fix="The installation is incomplete: reinstall armdesign, or restore the folder beside the package.",
    )


@cache
def templates_in(folder: Path) -> jinja2.Environment:
    """The templates of a folder, compiled once."""
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(folder),
        undefined=jinja2.StrictUndefined,
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )


def render(name: str, context: dict[str, Any], package: Path = PACKAGE) -> str:
    """Fill in a template; markup in a value is escaped, a value that is not given is an error.

    Args:
        name: File name of the template.
        context: The values it uses.
        package: Folder of the package.

    Raises:
        ArmDesignError: The template is missing, is not a template, or uses a value that is not given.
    """
    path = template_path(name, package)
    try:
        return templates_in(path.parent).get_template(path.name).render(context)
    except jinja2.TemplateError as error:
        line = getattr(error, "lineno", None)
        where = f"{path}, line {line}" if line else str(path)
        raise ArmDesignError(f"the template {where} cannot be filled in: {error}", value=name) from error
