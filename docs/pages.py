"""The pages of the site that are made of the code, and links to what lies outside docs; a hook of MkDocs.

Commands and options come from the command line itself, settings from their declaration, result.json from its schema,
the Python API from the docstrings. ``python docs/pages.py PAGE`` prints one of them.
"""

from __future__ import annotations

import dataclasses
import json
import posixpath
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import typer

import armdesign
from armdesign.cli import COMMANDS, EXIT_CODES, load_command
from armdesign.cli.setting_flags import panel_of
from armdesign.demonstration.files.formats import listed_formats
from armdesign.runs.folder import RESULT_SCHEMA
from armdesign.settings.kinds import flag_name, toml_value
from armdesign.settings.sections import SECTIONS

ROOT = Path(__file__).resolve().parents[1]
COPIES = {"CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md", "examples/README.md": "examples.md"}
"""Files outside docs that are pages, too."""
ELSEWHERE = {
    "README.md": "index.md", "LICENSE": "index.md", "benchmarks/best_known.json": "benchmark.md",
    "benchmarks/record/search.csv": "benchmark.md",
}  # fmt: skip
"""Files outside docs whose place on the site is another page."""

SHIM = "https://unpkg.com/iframe-worker/shim"


# ------------------------------------------------------------------ pages made of the code


def commands_page() -> str:
    """Every command with its arguments and options, as its help has them."""
    parts = ["# Commands", f"`armdesign COMMAND --help` says the same. {EXIT_CODES}"]
    for name, (_, line) in COMMANDS.items():
        command = load_command(name)
        inner = getattr(command, "commands", None)
        if inner is None:
            parts += command_section(f"armdesign {name}", command)
            continue
        parts += [f"## armdesign {name}", line]
        for each in inner:
            parts += command_section(f"armdesign {name} {each}", inner[each], level="###")
    return "\n\n".join(parts) + "\n"


def command_section(path: str, command: Any, level: str = "##") -> list[str]:  # noqa: ANN401 (Click's, by Typer)
    """A command's heading, usage, text and a table for each panel of options.

    Args:
        path: How it is called.
        command: The command.
        level: Marks of its heading.
    """
    context = typer.Context(command, info_name=path, help_option_names=["-h", "--help"])
    usage = f"{path} {' '.join(command.collect_usage_pieces(context))}"
    panels: dict[str, list[tuple[str, str]]] = {}
    for parameter in command.get_params(context):
        record = parameter.get_help_record(context)
        if record is not None:
            is_argument = parameter.param_type_name == "argument"
            panel = getattr(parameter, "rich_help_panel", None) or ("Arguments" if is_argument else "Options")
            name = parameter.metavar or record[0] if is_argument else record[0]
            panels.setdefault(panel, []).append((name, record[1]))
    parts = [f"{level} {path}", f"```text\n{usage}\n```", escaped(command.help or "")]
    for panel, rows in panels.items():
        table = [f"| {panel} | |", "|---|---|", *(f"| {code(name)} | {escaped(words)} |" for name, words in rows)]
        parts.append("\n".join(table))
    return parts


def settings_page() -> str:
    """Every setting with its meaning, what it allows, its default and its flag."""
    parts = [
        "# Settings",
        "The entries of `settings.toml`, section by section; `armdesign search --write-config` prints them all with "
        "comments, `--config FILE` takes them. Entries with a flag can be given on the command line, which counts more "
        "than the file. In Python the sections are classes: `Settings(design=Design(dof=4))`.",
    ]
    for kind in SECTIONS:
        rows = [f"## [{kind.title()}]", "", (kind.__doc__ or "").split("\n", maxsplit=1)[0], ""]
        rows += ["| setting | meaning | allowed | default | flag |", "|---|---|---|---|---|"]
        for entry in dataclasses.fields(kind):  # type: ignore[arg-type]
            made = entry.default_factory
            default = entry.default if made is dataclasses.MISSING else made()
            shown = "not set" if default is None else code(toml_value(default))
            flag = code(flag_name(entry)) if panel_of(entry, kind) else ""
            meaning, allowed = (
                escaped(" ".join(entry.metadata["doc"].split())),
                escaped(entry.metadata["kind"].describe()),
            )
            rows.append(f"| `{entry.name}` | {meaning} | {allowed} | {shown} | {flag} |")
        parts.append("\n".join(rows))
    return "\n\n".join(parts) + "\n"


def result_page() -> str:
    """The entries of result.json, as its schema describes them."""
    schema = json.loads(RESULT_SCHEMA.read_text(encoding="utf-8"))
    always = set(schema["required"])
    rows = [
        f"| `{name}` | {kind} | {escaped(words)} | {'always' if name.split('.')[0].rstrip('[]') in always else ''} |"
        for name, kind, words in entries(schema, schema)
    ]
    return "\n".join([
        "# result.json", "",
        f"{schema['description']} The schema itself, `armdesign/runs/result.schema.json`, comes along; "
        "runs of every kind are held against it by the tests. A run inside a run folder (`demonstration_2`) has the "
        "entries that are always there. `build` and `evaluate` leave out what is of a search.", "",
        "```python", "import json, jsonschema", "from armdesign.runs.folder import RESULT_SCHEMA", "",
        "schema = json.loads(RESULT_SCHEMA.read_text())",
        'jsonschema.validate(json.load(open("runs/lift/result.json")), schema)', "```", "",
        "| entry | type | meaning | |", "|---|---|---|---|", *rows, "",
    ])  # fmt: skip


def entries(schema: Mapping[str, Any], whole: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, str, str]]:
    """Name, type and meaning of the entries of an object, those inside it behind it.

    Args:
        schema: Schema of the object.
        whole: The schema that has the definitions.
        before: Name of the object, with a dot.
    """
    for name, each in schema.get("properties", {}).items():
        target = dict(whole["$defs"][each["$ref"].rpartition("/")[2]]) if "$ref" in each else {}
        entry = target | each
        kinds = entry.get("type", str(entry.get("const", "")))
        yield f"{before}{name}", ", ".join([kinds] if isinstance(kinds, str) else kinds), entry.get("description", "")
        if before.count(".") < 2:
            yield from entries(entry, whole, f"{before}{name}.")
            items = entry.get("items", {})
            items = whole["$defs"][items["$ref"].rpartition("/")[2]] if "$ref" in items else items
            yield from entries(items, whole, f"{before}{name}[].")


def api_page() -> str:
    """The public names by their docstrings."""
    names = [name for name in armdesign.__all__ if name in armdesign._HOMES]
    parts = [
        "# Python",
        "`import armdesign` shows these names and nothing else. Settings have a [page of their own](settings.md).",
    ]
    sections = {kind.__name__ for kind in SECTIONS} | {"Settings"}
    parts += [f"::: armdesign.{armdesign._HOMES[name]}.{name}" for name in names if name not in sections]
    return "\n\n".join(parts) + "\n"


GENERATED: Mapping[str, Callable[[], str]] = {
    "reference/commands.md": commands_page,
    "reference/settings.md": settings_page,
    "reference/result.md": result_page,
    "reference/api.md": api_page,
}


def escaped(text: str) -> str:
    """Text for a cell of a table or a paragraph."""
    marked = " ".join(text.split()).replace("&", "&amp;").replace("<", "&lt;")
    return re.sub(r"([|*_\[\]`])", r"\\\1", marked)


def code(text: str) -> str:
    """Text as code in a cell of a table."""
    return f"`{text}`"


# ------------------------------------------------------------------ hooks


def equation(source: str, language: str, css_class: str, options: Any, md: Any, **more: Any) -> str:  # noqa: ANN401
    """An equation in LaTeX as MathML, which browsers show without a script: the format of a fence called math.

    Args:
        source: The equation.
        language: The fence's name.
        css_class: Class of the block.
        options: Not used.
        md: Not used.
        more: Not used.
    """
    from latex2mathml.converter import convert  # noqa: PLC0415 (needed where there is an equation)

    return f'<div class="{css_class}">{convert(source.strip(), display="block")}</div>'


def on_files(files: Any, config: Any) -> Any:  # noqa: ANN401 (MkDocs')
    """Add the pages that are made of the code and those that lie outside docs.

    Args:
        files: The files of the site.
        config: Of the site.
    """
    from mkdocs.structure.files import File  # noqa: PLC0415 (an extra)

    for path, page in GENERATED.items():
        files.append(File.generated(config, path, content=page()))
    for source, path in COPIES.items():
        files.append(File.generated(config, path, content=(ROOT / source).read_text(encoding="utf-8")))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:  # noqa: ANN401 (MkDocs')
    """Let links to files outside docs go to their pages.

    Args:
        markdown: The page.
        page: The page.
        config: Of the site.
        files: Of the site.
    """
    path = page.file.src_uri
    if path in GENERATED:
        return markdown
    markdown = markdown.replace("<!-- formats -->", listed_formats())
    source = next((source for source, copy in COPIES.items() if copy == path), f"docs/{path}")

    def link(found: re.Match[str]) -> str:
        target, mark, anchor = found[1].partition("#")
        return f"]({place_of(target, source, path)}{mark}{anchor})"

    return re.sub(r"\]\((?!https?://|#)([^)\s]+)\)", link, markdown)


def on_post_build(config: Any) -> None:  # noqa: ANN401 (MkDocs')
    """Let the pages take the one script that Material has from elsewhere out of the site.

    Args:
        config: Of the site.
    """
    site = Path(config.site_dir)
    for page in site.rglob("*.html"):
        up = "../" * (len(page.relative_to(site).parts) - 1)
        page.write_text(
            page.read_text(encoding="utf-8").replace(SHIM, f"{up}assets/iframe-worker.js"), encoding="utf-8"
        )


def place_of(target: str, source: str, path: str) -> str:
    """Where a link of a file leads to on the site.

    Args:
        target: The link, relative to the file.
        source: The file, relative to the repository.
        path: Its page, relative to docs.
    """
    goal = posixpath.normpath(posixpath.join(posixpath.dirname(source), target))
    inside = goal.removeprefix("docs/") if goal.startswith("docs/") else {**COPIES, **ELSEWHERE}.get(goal)
    if inside is None:
        raise ValueError(f"{source} links to {target}, which is no part of the site")
    return posixpath.relpath(inside, posixpath.dirname(path) or ".")


if __name__ == "__main__":
    print(GENERATED[sys.argv[1]]())
