"""The site of docs/, built strictly: all pages, the API, and links that lead somewhere."""

import json
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from pages import PAGES, ROOT
from test_docs import CALLABLE

pytestmark = pytest.mark.slow

DOCS = ROOT / "docs"
NOTEBOOKS = sorted(DOCS.rglob("*.ipynb"))
LOADED = {"img": "src", "script": "src", "link": "href"}  # a page's own files, not where it leads


class Html(HTMLParser):
    """A page of the site: its anchors, where it leads, the files that it loads."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.anchors.update(given[key] for key in ("id", "name") if given.get(key))
        if tag == "a" and given.get("href"):
            self.links.append(given["href"])
        elif given.get(LOADED.get(tag, "")):
            self.loaded.append(given[LOADED[tag]])


def build(configuration, target):
    """What mkdocs says of a strict build."""
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--config-file", configuration]
    return subprocess.run([*command, "--site-dir", target], capture_output=True, text=True)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The folder of the site."""
    target = tmp_path_factory.mktemp("site")
    done = build(DOCS / "site" / "mkdocs.yml", target)
    assert done.returncode == 0, done.stderr
    return target


@pytest.fixture(scope="module")
def pages(site):
    """All pages by their paths."""
    return {path: Html(path) for path in site.rglob("*.html")}


def test_all_pages_are_there_and_found_by_the_search(site, pages):
    names = {str(page.relative_to(DOCS).with_suffix(".html")) for page in [*PAGES[1:], *NOTEBOOKS]}
    assert names == {str(path.relative_to(site)) for path in pages} - {"404.html"}
    found = json.loads((site / "search" / "search_index.json").read_text())["docs"]
    assert {entry["location"].partition("#")[0] for entry in found} == names


def test_the_api_has_all_that_its_page_names(site, pages):
    names = set(CALLABLE.findall((DOCS / "reference" / "api.md").read_text()))
    assert names - pages[site / "reference" / "api.html"].anchors == set()


def test_every_link_inside_the_site_leads_somewhere(site, pages):
    checked, lost = 0, []
    for path, page in pages.items():
        if path.name == "404.html":  # its links are of a server's root
            continue
        for link in [*page.links, *page.loaded]:
            parts = urlsplit(link)
            if parts.scheme:
                continue
            checked += 1
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            target = target / "index.html" if target == site.resolve() else target
            anchor = unquote(parts.fragment)
            if not target.is_file() or (anchor and anchor not in pages[target].anchors):
                lost.append((path.name, link))
    assert checked > 1000 and lost == []


def test_pages_load_nothing_from_elsewhere(pages):
    assert [url for page in pages.values() for url in page.loaded if urlsplit(url).netloc] == []


@pytest.mark.parametrize("link", ["index.md#no-such-place", "nowhere.md", "how_to/scenes.html"])
def test_a_link_that_is_lost_stops_the_build(link, tmp_path):
    """Without the API, whose modules lie elsewhere."""
    docs = tmp_path / "docs"
    (docs / "site").mkdir(parents=True)
    for name in ("mkdocs.yml", "hooks.py", "reference.py"):
        shutil.copy(DOCS / "site" / name, docs / "site")
    for page in [*PAGES[1:], *NOTEBOOKS]:
        copy = docs / page.relative_to(DOCS)
        copy.parent.mkdir(exist_ok=True)
        if page in NOTEBOOKS:
            for file in (page, *page.parent.glob("*.png")):
                shutil.copy(file, copy.parent)
        else:
            copy.write_text(f"# {page.stem}\n")
    assert build(docs / "site" / "mkdocs.yml", tmp_path / "built").returncode == 0
    (docs / "index.md").write_text(f"# Front page\n\n[there]({link})\n")
    done = build(docs / "site" / "mkdocs.yml", tmp_path / "built")
    assert done.returncode == 1 and link in done.stderr
