"""A page from a template: everything it needs goes into the one file, plotly.js compressed, which
the browser unpacks.

plotly.js as the plotly package has it, with all kinds of charts, is 4.8 MB, compressed 2.0 MB. Its
bundle `gl3d` is 0.7 MB compressed; it has lines and meshes in space, but neither heat maps nor
parallel axes. It stands in plotly_gl3d/ as npm has it: `npm pack plotly.js-gl3d-dist-min@4.1.1`,
then `gzip -9n`. A page works wherever it is moved to, so no file beside it holds plotly.js.
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
from plotly.offline import get_plotlyjs

from softsim import __version__
from softsim.output.folder import json_value, replacing
from softsim.report import style

PAGE = "report.html"


@cache
def lines_and_meshes() -> str:
    """The bundle `gl3d` of plotly.js, compressed: charts of kinds scatter and mesh3d."""
    bundle = files("softsim.report.page") / "plotly_gl3d" / "plotly-gl3d.min.js.gz"
    return b64encode(bundle.read_bytes()).decode("ascii")


@cache
def all_charts() -> str:
    """The whole of plotly.js, compressed."""
    return compressed(get_plotlyjs())


def compressed(text: str) -> str:
    """A text in gzip's format, in base64: unpack.js has it back."""
    return b64encode(gzip.compress(text.encode("utf-8"), mtime=0)).decode("ascii")


def write_page(template: str, plotly_js: str, context: Mapping[str, Any], path: Path) -> None:
    """Write the page that `template`, a file of templates/ on top of base.html, makes of `context`.

    plotly_js: compressed. context: what the template names; `title` at least. All text in it is
    escaped.
    Raises OutputError if the disk refuses.
    """
    text = _environment().get_template(template).render(context, plotly_js=plotly_js)
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
    environment.globals |= {"style": style, "version": __version__}
    environment.filters["compressed"] = compressed
    return environment


def _compact_json(content: Any, **options: Any) -> str:
    """JSON that browsers read: they know neither NaN nor infinity, which become null."""
    return json.dumps(json_value(content), separators=(",", ":"), allow_nan=False)
