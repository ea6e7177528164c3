"""MkDocs hooks: notebooks become pages, and formulas become MathML when the site is built."""

import re
from html import unescape

from latex2mathml.converter import convert
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from nbconvert import MarkdownExporter

FORMULA = re.compile(
    r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL
)  # what pymdownx.arithmatex makes of $...$ and $$...$$


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Replace each notebook by a page of Markdown with its text and code."""
    exporter = MarkdownExporter()
    for notebook in [file for file in files if file.src_uri.endswith(".ipynb")]:
        text, _ = exporter.from_filename(notebook.abs_src_path)
        page = notebook.src_uri.replace(".ipynb", ".md")
        files.remove(notebook)
        files.append(File.generated(config, page, content=text))
    return files


def on_page_markdown(markdown: str, **_: object) -> str:
    """Point links at the pages of notebooks; in a repository they open the notebooks."""
    return markdown.replace(".ipynb)", ".md)")


def on_page_content(html: str, **_: object) -> str:
    """Replace formulas in LaTeX by MathML, which browsers draw without any script."""

    def mathml(formula: re.Match[str]) -> str:
        display = "block" if formula[1] == "div" else "inline"
        return convert(unescape(formula[2]).strip(), display=display)

    return FORMULA.sub(mathml, html)
