"""Writer of pages: one file with everything that it needs.

It includes plotly.js in compressed form, which the browser unpacks. plotly_js/ has plotly.js with
the kinds of charts that pages have, and the instructions to make it: compressed it is 0.6 MB, with
all kinds of charts it would be 2.0 MB. A page works wherever it is moved to, so plotly.js is not in
a separate file.
"""

import gzip
import json
from base64 import b64encode
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from softsim import __version__
from softsim.output.folder import json_value, replacing
from softsim.report import style

PAGE = "report.html"

DIRECTIONS = {
    code: f"\\u{code:04x}"
    for code in (0x061C, 0x200E, 0x200F, *range(0x202A, 0x202F), *range(0x2066, 0x206A))
}
"""Visible replacements of the control characters of writing directions.

These are marks, embeddings, overrides and isolates; unchanged, they could make a name or a path
read differently from what it is (Unicode TR36).
"""


@cache
def plotly_js() -> str:
    """Return plotly.js in compressed form.

    It has the charts scatter, scatter3d, mesh3d, heatmap and parcoords.
    """
    bundle = files("softsim.report.page") / "plotly_js" / "plotly.min.js.gz"
    return b64encode(bundle.read_bytes()).decode("ascii")


def visible(value: Any) -> Any:
    """Return a text with the code points of DIRECTIONS written out, any other value as it is."""
    return value.translate(DIRECTIONS) if isinstance(value, str) else value


def compressed(text: str) -> str:
    """Return a text compressed by gzip and encoded in base64, which unpack.js decodes."""
    return b64encode(gzip.compress(text.encode("utf-8"), mtime=0)).decode("ascii")


def write_page(template: str, context: Mapping[str, Any], path: Path) -> None:
    """Write the page from `template`, a file of templates/ that extends base.html.

    context: the variables of the template; `title` at least. All text in it is escaped. Raises
    OutputError if the file cannot be written.
    """
    text = _environment().get_template(template).render(context, plotly_js=plotly_js())
    with replacing(path) as partial:
        partial.write_text(text, encoding="utf-8")


def _environment() -> Environment:
    """Return the template environment, which escapes output and rejects undefined names."""
    environment = Environment(
        loader=PackageLoader("softsim.report.page"),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=visible,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.policies["json.dumps_function"] = _compact_json
    environment.globals |= {"style": style, "version": __version__}
    environment.filters["compressed"] = compressed
    return environment


def _compact_json(content: Any, **options: Any) -> str:
    """Return JSON that browsers can read: NaN and infinity, which they reject, become null."""
    text = json.dumps(
        json_value(content), separators=(",", ":"), allow_nan=False, ensure_ascii=False
    )
    return text.translate({code: f"\\{written}" for code, written in DIRECTIONS.items()})
