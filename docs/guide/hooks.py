"""Inserts the help texts of the program when the guide is built, so that they stay up to date."""

from __future__ import annotations

import os
import pathlib
import re
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]
MARK = "<!-- the help of every command -->"


def program() -> str | None:
    """Returns the path of the program that UNLIFT_PROGRAM names, or else that of this working tree."""
    places = [os.environ.get("UNLIFT_PROGRAM"), ROOT / "target/debug/unlift", ROOT / "target/release/unlift"]
    return next((os.path.abspath(place) for place in places if place and os.access(place, os.X_OK)), None)


def help_of(binary: str, *command: str) -> str:
    run = subprocess.run([binary, *command, "--help"], check=True, capture_output=True, text=True)
    return run.stdout.rstrip()


def sections(binary: str, *command: str) -> list[str]:
    """Returns a heading and the help of a command, followed by those of its subcommands."""
    text = help_of(binary, *command)
    name = " ".join(("unlift", *command))
    found = [f"## {name}\n\n```text\n{text}\n```\n"]
    listed = re.findall(r"^(?:Commands|Audits|Stages|Tools):\n((?:  .*\n)+)", text, re.MULTILINE)
    for line in "".join(listed).splitlines():
        sub = re.match(r"  ([a-z-]+) ", line)
        if sub and sub.group(1) != "help":
            found += sections(binary, *command, sub.group(1))
    return found


def on_page_markdown(markdown: str, **_: object) -> str:
    if MARK not in markdown:
        return markdown
    binary = program()
    if binary is None:
        return markdown.replace(MARK, "This copy of the guide was built without the program: ask `unlift COMMAND --help`.")
    return markdown.replace(MARK, "\n".join(sections(binary)))


def on_page_content(html: str, **_: object) -> str:
    """Keeps a number and its percent sign on one line."""
    parts = re.split(r"(<pre>.*?</pre>)", html, flags=re.DOTALL)
    return "".join(part if part.startswith("<pre>") else re.sub(r"(\d) %", r"\1&nbsp;%", part) for part in parts)
