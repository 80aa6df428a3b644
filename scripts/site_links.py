"""Links of the docs to files outside of docs/, which the site does not have: their text stays, the path beside it.

Hooks of MkDocs (mkdocs.yml). A file that is not in the repository fails the build.
"""

import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[1]
LINK = re.compile(r"(!?)\[([^\]]*)\]\((\.\./[^)#\s]+)\)")


def on_page_markdown(markdown, page, **_):
    folder = (ROOT / "docs" / page.file.src_uri).parent

    def plain(link):
        target = (folder / link[3]).resolve()
        if target.is_relative_to(ROOT / "docs"):
            return link[0]
        if not target.exists():
            raise FileNotFoundError(f"{page.file.src_uri} links to {link[3]}, which is not in the repository")
        return f"{link[2]} (`{target.relative_to(ROOT)}` in the repository)"

    return LINK.sub(plain, markdown)


def on_page_content(html, **_):
    # Roles of Sphinx in docstrings, which MkDocs does not know.
    return re.sub(r":(?:meth|class|attr|func):(?=<code>)", "", html)
