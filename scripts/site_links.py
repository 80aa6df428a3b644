"""What the site has beside the pages of docs/: the references of Rust and C. And links to files that it does not have: their
text stays, the path beside it.

Hooks of MkDocs (mkdocs.yml). A file that is not in the repository fails the build.
"""

import pathlib
import re
import shutil

from mkdocs.structure.files import File

ROOT = pathlib.Path(__file__).resolve().parents[1]
#: What `cargo doc` made of the crates for users (scripts/site).
RUST = ROOT / "target" / "rustdoc" / "doc"
HEADER = ROOT / "crates" / "ropewalk-c" / "include" / "ropewalk.h"
LINK = re.compile(r"(!?)\[([^\]]*)\]\((\.\./[^)#\s]+)\)")


def on_files(files, config, **_):
    # So that links to them are checked; their text follows when the site is built.
    for page in RUST.glob("*/index.html"):
        files.append(File.generated(config, f"rust/{page.relative_to(RUST)}", content=""))
    return files


def on_post_build(config, **_):
    if RUST.exists():
        shutil.copytree(RUST, pathlib.Path(config.site_dir) / "rust", dirs_exist_ok=True)


def check_tables(markdown, page):
    """A table whose rows have more or fewer cells than its header is none on some hosts, and loses cells on others."""
    lines = re.sub(r"`[^`\n]*`", "", markdown).split("\n")
    cells = [len(re.findall(r"(?<!\\)\|", line)) if line.startswith("|") else 0 for line in lines]
    for i, (before, here) in enumerate(zip(cells, cells[1:])):
        if before and here and before != here:
            raise ValueError(f"{page.file.src_uri}: expected {before - 1} cells as in the row before, found {here - 1}: {lines[i + 1]}")


def on_page_markdown(markdown, page, **_):
    check_tables(markdown, page)
    folder = (ROOT / "docs" / page.file.src_uri).parent

    def plain(link):
        target = (folder / link[3]).resolve()
        if target.is_relative_to(ROOT / "docs"):
            return link[0]
        if not target.exists():
            raise FileNotFoundError(f"{page.file.src_uri} links to {link[3]}, which is not in the repository")
        return f"{link[2]} (`{target.relative_to(ROOT)}` in the repository)"

    markdown = markdown.replace("<!-- the header -->", f"```c\n{HEADER.read_text()}```")
    return LINK.sub(plain, markdown)


def on_page_content(html, **_):
    # Roles of Sphinx in docstrings, which MkDocs does not know.
    return re.sub(r":(?:meth|class|attr|func):(?=<code>)", "", html)
