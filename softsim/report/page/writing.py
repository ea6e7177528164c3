"""A page from a template: everything it needs goes into the one file, plotly.js compressed, which
the browser unpacks.

plotly_js/ has plotly.js with the kinds of charts that pages have, and how it is made: compressed it
is 0.6 MB, with all kinds of charts it would be 2.0 MB. A page works wherever it is moved to, so no
file beside it holds plotly.js.
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
"""Marks, embeddings, overrides and isolates of writing directions, and how a page shows each: as
they are, they would let a name or a path read differently from what it is (Unicode TR36)."""


@cache
def plotly_js() -> str:
    """plotly.js, compressed: charts of kinds scatter, scatter3d, mesh3d, heatmap and parcoords."""
    bundle = files("softsim.report.page") / "plotly_js" / "plotly.min.js.gz"
    return b64encode(bundle.read_bytes()).decode("ascii")


def visible(value: Any) -> Any:
    """Return a text with the code points of DIRECTIONS written out, any other value as it is."""
    return value.translate(DIRECTIONS) if isinstance(value, str) else value


def compressed(text: str) -> str:
    """A text in gzip's format, in base64: unpack.js has it back."""
    return b64encode(gzip.compress(text.encode("utf-8"), mtime=0)).decode("ascii")


def write_page(template: str, context: Mapping[str, Any], path: Path) -> None:
    """Write the page that `template`, a file of templates/ on top of base.html, makes of `context`.

    context: what the template names; `title` at least. All text in it is escaped.
    Raises OutputError if the disk refuses.
    """
    text = _environment().get_template(template).render(context, plotly_js=plotly_js())
    with replacing(path) as partial:
        partial.write_text(text, encoding="utf-8")


def _environment() -> Environment:
    """Templates that escape what they print and refuse names that the context does not have."""
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
    """JSON that browsers read: they know neither NaN nor infinity, which become null."""
    text = json.dumps(
        json_value(content), separators=(",", ":"), allow_nan=False, ensure_ascii=False
    )
    return text.translate({code: f"\\{written}" for code, written in DIRECTIONS.items()})
