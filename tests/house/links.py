"""Every page and picture that the documents point to exists: links, and paths in backquotes below docs/ or scripts/.

    links.py ROOT
"""

import pathlib
import re
import sys

LINK = re.compile(r"\]\((?!https?:)([^)#\s]+)|`((?:docs|scripts|samples|tests)/[\w./-]+\.\w+)`|\((docs/[\w./-]+\.md)\)")

root = pathlib.Path(sys.argv[1])
pages = sorted([*root.glob("*.md"), *root.glob("docs/*.md"), *root.glob("samples/*.md")])
wrong = 0
for page in pages:
    for match in LINK.finditer(page.read_text(encoding="utf-8")):
        link, path, named = match.groups()
        if link and not (page.parent / link).exists() and not (root / link).exists():
            wrong += 1
            print(f"{page.relative_to(root)}: points to {link}, which does not exist")
        if (path or named) and not (root / (path or named)).exists():
            wrong += 1
            print(f"{page.relative_to(root)}: names {path or named}, which does not exist")
print(f"{len(pages)} pages, {wrong} faults")
sys.exit(1 if wrong else 0)
