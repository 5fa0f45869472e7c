"""Runs the examples of the guide as a reader would, and checks every number with decimals that a page quotes.

    python3 docs/guide/run_examples.py             # all but the slow ones
    python3 docs/guide/run_examples.py --slow      # the demo, too

Each page runs in an empty folder. A block after

    <!-- run -->              is run by `sh -e`, or, if it is Python, in one namespace for the page (skipped where unlift is not installed)
    <!-- run: exit 1 -->      must end in this exit code
    <!-- run: slow -->        only with --slow
    <!-- setup -->            anywhere on a page: its folder has PROJECT, a COLMAP project (fixture.py)
    <!-- output -->           must have been printed, line by line, by the block before it; a line of `...` stands for any lines

Numbers in the text of a page (with a decimal point, or before `%`) must be printed by its examples, or be in a document of the repository
that the paragraph links to. Figures of ARTIFACT.md are checked, too. Links to documents of the repository must lead to a file and a heading.
"""

from __future__ import annotations

import contextlib
import importlib.util
import io
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.dirname(__file__))
sys.dont_write_bytecode = True
from hooks import ROOT, program  # noqa: E402

PAGES = ROOT / "docs" / "guide" / "pages"
REPOSITORY = "https://github.com/unlift/unlift/blob/main/"
FENCE = re.compile(r"(?:<!-- (run|output)(?:: ([^>]*?))? -->\n)?```(\w*)[^\n]*\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FIGURE = re.compile(r"(?<![\w.@:=])\d+(?:\.\d+)?(?![\w.])(?=\s?%)|(?<![\w.@:=/])\d+\.\d+(?![\w.])")


def anchor(heading: str) -> str:
    """Returns the name that GitHub gives a heading in links."""
    kept = "".join(c for c in heading.lstrip("#").strip().lower() if c.isalnum() or c in " -_")
    return kept.replace(" ", "-")


class Page:
    def __init__(self, path: pathlib.Path, slow: bool) -> None:
        self.path, self.slow = path, slow
        self.text = path.read_text()
        self.printed = ""  # by all blocks so far
        self.wrong: list[str] = []
        self.n = 0

    def complain(self, what: str) -> None:
        self.wrong.append(f"{self.path.relative_to(ROOT)}: {what}")

    def run(self, binary: str | None) -> None:
        last: str | None = None
        names: dict[str, object] = {"__name__": "guide"}
        with tempfile.TemporaryDirectory() as folder:
            shutil.copy(PAGES / "room.py", folder)
            if "<!-- setup -->" in self.text:
                subprocess.run([sys.executable, PAGES.parent / "fixture.py"], cwd=folder, check=True)
            for kind, option, language, body in FENCE.findall(self.text):
                if kind == "output":
                    self.compare(last, body)
                elif kind == "run":
                    last = self.python(names, folder, body) if language == "python" else self.shell(binary, folder, body, option)
                    self.printed += last or ""
                    self.n += last is not None

    def shell(self, binary: str | None, folder: str, body: str, option: str) -> str | None:
        if binary is None or ("slow" in option and not self.slow):
            return None
        path = os.pathsep.join([os.path.dirname(binary), os.path.dirname(sys.executable), os.environ.get("PATH", "")])
        run = subprocess.run(["sh", "-e", "-c", body], cwd=folder, env=os.environ | {"PATH": path}, capture_output=True, text=True)
        code = re.search(r"exit (\d+)", option)
        if run.returncode != (int(code.group(1)) if code else 0):
            self.complain(f"exit code {run.returncode}:\n{body}{run.stdout}{run.stderr}")
        return run.stdout + run.stderr

    def python(self, names: dict[str, object], folder: str, body: str) -> str | None:
        if importlib.util.find_spec("unlift") is None:
            return None
        out = io.StringIO()
        try:
            with contextlib.chdir(folder), contextlib.redirect_stdout(out):
                exec(compile(body, str(self.path), "exec"), names)
        except Exception as error:  # noqa: BLE001
            self.complain(f"{type(error).__name__}: {error}\n{body}")
        return out.getvalue()

    def compare(self, printed: str | None, body: str) -> None:
        if printed is None:
            self.printed += body  # not run here: what it says of itself
            return
        lines = [line.rstrip() for line in printed.splitlines()]
        for line in body.splitlines():
            if line.strip() != "..." and line.rstrip() not in lines:
                self.complain(f"not in the output: {line}\n--\n{printed}--")

    def figures(self) -> None:
        prose = re.sub(r"^```.*?^```$", "", self.text, flags=re.MULTILINE | re.DOTALL)
        before = ""
        for paragraph in re.split(r"\n\s*\n", prose):
            linked = "".join(self.linked(paragraph))
            if paragraph.lstrip().startswith("|"):
                linked += before  # a table is introduced by the paragraph above
            before = linked
            bare = re.sub(r"`[^`]*`|\]\([^)]*\)|<!--.*?-->|<[^>]*>", " ", paragraph)
            for figure in FIGURE.findall(bare):
                seen = re.compile(rf"(?<![\d.]){re.escape(figure)}(?![\d]|\.\d)")
                if not seen.search(self.printed) and not seen.search(linked):
                    self.complain(f"no example prints {figure}, no linked document has it: {paragraph.strip()[:100]}")

    def linked(self, text: str) -> list[str]:
        found = []
        for target in re.findall(rf"\]\({re.escape(REPOSITORY)}([^)]*)\)", text):
            name, _, heading = target.partition("#")
            path = ROOT / name
            if not path.exists():
                self.complain(f"leads nowhere: {target}")
                continue
            document = path.read_text() if path.is_file() else ""
            if heading and heading not in {anchor(line) for line in document.splitlines() if line.startswith("#")}:
                self.complain(f"no such heading: {target}")
            found.append(document)
        return found


def artifact() -> list[str]:
    """Checks that our figures in ARTIFACT.md are in the documents it names, and the paper's in its tables."""
    cards = (ROOT / "crates/unlift-vision/models").glob("*/README.md")
    ours = "".join(path.read_text() for path in (ROOT / "docs/benchmarks.md", *cards))
    paper = "".join(path.read_text() for path in (ROOT / "docs/paper").glob("*.csv"))
    rows = [[cell.strip() for cell in line.split("|")] for line in (ROOT / "ARTIFACT.md").read_text().splitlines() if line.startswith("| ")]
    return [f"ARTIFACT.md: {figure} is not where it should come from: {row[1]}"
            for row in rows for cell, source in ((row[3], ours), (row[4], paper)) for figure in re.findall(r"\d+\.\d+", cell)
            if not re.search(rf"(?<![\d.]){re.escape(figure)}(?!\d|\.\d)", source)]


def main() -> int:
    binary = program()
    if binary is None:
        print("no program unlift is built: examples of the command line are not run")
    if importlib.util.find_spec("unlift") is None:
        print("unlift is not installed in this Python: its examples are not run")
    wrong = artifact()
    for path in sorted(PAGES.rglob("*.md")):
        started = time.monotonic()
        page = Page(path, "--slow" in sys.argv[1:])
        page.run(binary)
        page.figures()
        if page.n:
            print(f"{path.relative_to(PAGES)}: {page.n} examples, {time.monotonic() - started:.1f} s", flush=True)
        wrong += page.wrong
    for complaint in wrong:
        print(complaint, file=sys.stderr)
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
