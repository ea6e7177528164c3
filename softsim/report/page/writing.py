"""A page from a template: everything it needs goes into the one file."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from plotly.offline import get_plotlyjs

from softsim import __version__
from softsim.output.folder import json_value, replacing
from softsim.report import style

PAGE = "report.html"


def write_page(template: str, context: Mapping[str, Any], path: Path) -> None:
    """Write the page that `template`, a file of templates/ on top of base.html, makes of `context`.

    context: what the template names; `title` at least. All text in it is escaped.
    Raises OutputError if the disk refuses.
    """
    text = _environment().get_template(template).render(context)
    with replacing(path) as partial:
        partial.write_text(text, encoding="utf-8")


def _environment() -> Environment:
    """Templates that escape what they print and refuse names that the context does not have."""
    environment = Environment(
        loader=PackageLoader("softsim.report.page"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.policies["json.dumps_function"] = _compact_json
    environment.globals |= {
        "style": style, "plotly_js": get_plotlyjs, "version": __version__,
    }  # fmt: skip
    return environment


def _compact_json(content: Any, **options: Any) -> str:
    """JSON that browsers read: they know neither NaN nor infinity, which become null."""
    return json.dumps(json_value(content), separators=(",", ":"), allow_nan=False)
