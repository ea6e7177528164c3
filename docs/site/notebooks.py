"""MkDocs hook that renders the notebooks of docs/ as pages when the site is built."""

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from nbconvert import MarkdownExporter


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
    """Lead links to notebooks, which open in a repository, to their pages."""
    return markdown.replace(".ipynb)", ".md)")
