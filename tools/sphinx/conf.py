"""Settings of Sphinx for `tools/manual`: the pages of docs/ as they are, in the order in which docs/README.md lists them."""

import re
import shutil
from pathlib import Path

from docutils import nodes

TOP = Path(__file__).resolve().parents[2]
MATHJAX = Path("/usr/share/javascript/mathjax")  # package libjs-mathjax

project = "Tubule"
author = "the authors of Tubule"
version = release = re.search(r"project\(Tubule VERSION (\S+)", (TOP / "CMakeLists.txt").read_text())[1]
html_title = f"Tubule {version}"

extensions = ["myst_parser", "sphinx.ext.mathjax"]
root_doc = "docs/README"
include_patterns = ["docs/**", "cases/README.md", "tests/README.md", "CONTRIBUTING.md"]  # pages that the index names
exclude_patterns = ["build"]
source_suffix = {".md": "markdown"}
suppress_warnings = ["myst.header"]

myst_enable_extensions = ["dollarmath", "html_image"]
myst_heading_anchors = 5  # as on GitHub
myst_update_mathjax = False

html_theme = "sphinx_rtd_theme"
html_theme_options = {"navigation_depth": 2}
html_static_path = ["static"]
html_css_files = ["manual.css"]
html_show_sourcelink = False
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False
pygments_style = "friendly"

# Formulas become SVG, by the part of MathJax that is copied beside the pages: fonts of other folders are not loaded from
# pages that are files.
mathjax_path = "mathjax/MathJax.js?config=TeX-AMS_SVG"
mathjax2_config = {"jax": ["input/TeX", "output/SVG"], "SVG": {"font": "TeX", "linebreaks": {"automatic": True}},
                   "showMathMenu": False, "messageStyle": "none"}  # fmt: skip
MATHJAX_PARTS = ("MathJax.js", "config/TeX-AMS_SVG.js", "extensions", "jax/element", "jax/input/TeX",
                 "jax/output/SVG/autoload", "jax/output/SVG/config.js", "jax/output/SVG/jax.js",
                 "jax/output/SVG/fonts/TeX")  # fmt: skip


def contents(text):
    """(heading, pages) in the order of the manual: below each heading in bold the pages that are linked as a whole, each
    where it is named first."""
    sections, known = [("", [])], set()
    for heading, target in re.findall(r"^\*\*([^*\n]+)\*\*|\]\(([^)#:\s]+\.md)\)", text, flags=re.M):
        if heading:
            sections.append((heading, []))
        elif target not in known:
            known.add(target)
            sections[-1][1].append(target)
    return [(heading, pages) for heading, pages in sections if pages]


def with_contents(text, folder=""):
    for heading, pages in contents(text):
        lines = "\n".join(page.removesuffix(".md") for page in pages if page.startswith(folder))
        caption = f":caption: {heading}\n" if heading else ""
        text += f"\n```{{toctree}}\n:hidden:\n{caption}\n{lines}\n```\n"
    return text


def read(app, name, source):
    """What MyST writes differently from GitHub: anchors, and the order of the pages."""
    text = re.sub(r'^<a id="(eq-[^"]+)"></a>$', r"(\1)=", source[0], flags=re.M)
    text = re.sub(r"\[([^\]\n]+)\]\([\w./]*#(eq-[\d.]+)\)", r"{ref}`\1 <\2>`", text)
    if name == root_doc:
        text = with_contents(text)
    if (TOP / name).is_dir():  # docs/decisions.md and docs/decisions/
        text = with_contents(text, f"{Path(name).name}/")
    source[0] = text


def unnumbered(app, doctree):
    """Equations have the numbers of their \\tag."""
    for node in doctree.findall(nodes.math_block):
        node["nowrap"] = True
        node.children = []
        text = f"\\[{node.rawsource or node.astext()}\\]"
        node.append(nodes.Text(text))


def copy_mathjax(app, error):
    if error or app.builder.name != "html":
        return
    for part in MATHJAX_PARTS:
        source, target = MATHJAX / part, Path(app.outdir) / "_static/mathjax" / part
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copytree(source, target, dirs_exist_ok=True) if source.is_dir() else shutil.copyfile(source, target)
    entry = '<!DOCTYPE html><meta charset="utf-8"><title>Tubule</title><meta http-equiv="refresh" content="0; url=%s.html">\n'
    (Path(app.outdir) / "index.html").write_text(entry % root_doc)


def setup(app):
    app.connect("source-read", read)
    app.connect("build-finished", copy_mathjax)
