"""Makes the picture of the README: the first row of the demo's page.

    unlift demo
    python3 docs/make_hero.py unlift-demo/report.html docs/hero.png    # needs Chromium; CHROMIUM names another browser
"""

import os
import pathlib
import re
import subprocess
import sys
import tempfile

WIDTH, HEIGHT = 1280, 360


def main(page: str, out: str) -> None:
    text = pathlib.Path(page).read_text()
    style = re.search(r"<style>.*?</style>", text, re.S)[0]
    row = re.search(r'<div class="three">.*?</div>', text, re.S)[0]
    html = f'<!doctype html><meta charset="utf-8">{style}<body style="padding: 14px 14px 0; background: #fff">{row}'
    with tempfile.TemporaryDirectory() as folder:
        row_page = pathlib.Path(folder) / "row.html"
        row_page.write_text(html)
        browser = os.environ.get("CHROMIUM", "chromium")
        options = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--force-device-scale-factor=1"]
        command = [browser, *options, f"--user-data-dir={folder}/profile", f"--window-size={WIDTH},{HEIGHT}"]
        subprocess.run([*command, f"--screenshot={pathlib.Path(out).resolve()}", row_page.as_uri()], check=True, capture_output=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
