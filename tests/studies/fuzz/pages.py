"""Pages of `tubule view` with titles and names of files that mean something to a browser, or to what makes the page.

A page is taken apart as the HTML standard says, comments within scripts included: it has its two scripts and no more, the data
are JSON, with the title, and the program of the page is whole."""

import html
import json
import re
from pathlib import Path

import toml
from samples import TUBE
from sandbox import Finding

STUDY = 3
DRAWING = Path(__file__).resolve().parents[3] / "tools/python/tubule/drawing"
PIECES = (
    "@DATA@", "@SCRIPT@", "@TITLE@", "<!--", "-->", "<script>", "</script>", "<SCRIPT ", "</title>", "<title>", "</", "<", ">", "&", "&lt;",
    "&amp;#60;", '"', "'", "\\", "\\u003c", "\\n", "$&", "\\1", "{}", "%s", "\u2028", "\u2029", "\x7f", "\x85", "\u202e", "\U0001f9ea", "]]>", "*/", "//", "`${x}`", " ", "wave", "\n",
)  # fmt: skip


def words(rng):
    return "".join(rng.choice(PIECES) for _ in range(rng.choice((1, 1, 2, 3, 6))))


def scripts(page):
    """The scripts of a page as (attributes, content), by the states of a tokenizer: within `<!-- <script` an end tag ends that alone."""
    found, at = [], 0
    while tag := re.compile(r"<script\b([^>]*)>", re.I).search(page, at):
        state, at = "data", tag.end()
        for token in re.compile(r"<!--|-->|<script[\s/>]|</script[\s/>]", re.I).finditer(page, at):
            word = token[0].lower()
            if word == "<!--":
                state = "escaped" if state == "data" else state
            elif word == "-->":
                state = "data"
            elif word.startswith("<script"):
                state = "double" if state == "escaped" else state
            elif state == "double":
                state = "escaped"
            else:
                found.append((tag[1], page[at:token.start()]))
                at = token.end()
                break
        else:
            raise Finding("page", f"a script that never ends: {page[tag.start():tag.start() + 80]!r}")
    return found


def judge(page, titles):
    found = scripts(page)
    if len(found) != 2 or 'id="data"' not in found[0][0]:
        raise Finding("page", f"{len(found)} scripts, of {[len(content) for _, content in found]} characters")
    try:
        data = json.loads(found[0][1])
    except json.JSONDecodeError as error:
        raise Finding("page", f"its data are no JSON: {error}; {found[0][1][:80]!r}") from error
    names = ("view", "view_body", "view_shapes") if data["kind"] == "shapes" else ("view", "view_scan")
    if found[1][1] != "\n".join((DRAWING / f"{name}.js").read_text(encoding="utf-8") for name in names):
        raise Finding("page", f"its script is not that of {', '.join(names)}")
    head = re.search(r"<title>(.*?)</title>", page, re.S)
    if data["title"] not in titles or html.unescape(head[1]) != data["title"]:
        raise Finding("page", f"one title of {titles!r}: {data['title']!r} in its data, {head[1][:80]!r} in its head")


def one(rng, box):
    title = words(rng).strip() or "x"
    name = rng.choice(("case", "case", words(rng).replace("/", "_").replace("\n", "_").lstrip("-") or "x"))[:60] + ".hdf"
    box.write("case.toml", TUBE.replace("0.2, output", "1e-3, output").replace("[0.01, 0.05]", "[]") + f"[about]\ntitle = {toml.string(title)}\n")
    kind = rng.choice((("run",), ("run",), ("scan", "--over=energy.k42=0,0.1", "--jobs=1")))
    if box.run(*kind[:1], "case.toml", *kind[1:], "--quiet", f"-o./{name}").status == 2:
        return "refused"
    shown = box.run("view", f"./{name}", "-opage.html", statuses=(0, 2))
    if shown.status == 2:
        raise Finding("refused", f"view refuses {name}, title {title!r}: {shown.err}")
    # A scan of a case without a title has the name of its file.
    judge((box.folder / "page.html").read_text(encoding="utf-8"), [title] if kind[0] == "run" else [name, title])
    return kind[0]
