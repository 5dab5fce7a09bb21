"""The site of these pages: Sphinx reads the Markdown that GitHub shows, at the same places. `.ci/site` builds it.

Sphinx with MyST, because it reads CommonMark as GitHub does (tables, mathematics, anchors of headings), fails on a link or an anchor that
leads nowhere, and comes from PyPI in seconds; Furo, because it can be read on a phone. Search runs in the browser, and no page loads
anything from another machine.
"""

import re
from pathlib import Path

from sphinx.application import Sphinx

ROOT = Path(__file__).resolve().parent.parent.parent
INDEX = "docs/README"

project = "refraxel"
copyright = "the refraxel authors"
version = re.search(r'^version = "(.*)"', (ROOT / "Cargo.toml").read_text(), re.MULTILINE)[1]
root_doc = "README"
include_patterns = ["*.md", "docs/*.md", "crates/refraxel-gpu/README.md", "scripts/README.md"]
exclude_patterns = ["target", "**/node_modules", ".git", "crates/refraxel-py", "viewer"]
extensions = ["myst_parser", "sphinx.ext.mathjax"]

myst_enable_extensions = ["dollarmath", "strikethrough"]
myst_fence_as_directive = ["math"]
myst_heading_anchors = 4
suppress_warnings = ["misc.highlighting_failure"]

html_theme = "furo"
html_title = f"refraxel {version}"
html_static_path = ["static"]
html_css_files = ["katex/katex.min.css", "site.css"]
html_show_sphinx = False
html_show_sourcelink = False
html_copy_source = False
# math.mjs replaces the formulas when the pages are built; no script is needed.
mathjax_path = "unused.js"


def tables_of_contents() -> str:
    """The sections and pages of docs/README.md, as the navigation."""
    text = (ROOT / f"{INDEX}.md").read_text()
    found = ["```{toctree}", ":hidden:", f"All pages <{INDEX}>", "```"]
    for section in text.split("\n## ")[1:]:
        title, _, rest = section.partition("\n")
        links = re.findall(r"\| \[(.+?)\]\((.+?)\) \|", rest)
        pages = [f"{name} <{(Path('docs') / target).as_posix().replace('docs/../', '').removesuffix('.md')}>" for name, target in links]
        found += ["```{toctree}", ":hidden:", f":caption: {title}", *pages, "```"]
    return "\n".join(found)


def add_navigation(app: Sphinx, name: str, source: list[str]) -> None:
    del app
    if name == root_doc:
        source[0] += "\n\n" + tables_of_contents() + "\n"


def setup(app: Sphinx) -> None:
    app.connect("source-read", add_navigation)
