"""A report in a real browser: every figure is visible, nothing is fetched, nothing is complained about."""

import json
import re
import shutil
import subprocess
from html import unescape

import pytest

from pbcs_ompl.results.report import write_report

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
PROBE = """<script>
const errors = [];
addEventListener("error", event => errors.push(String(event.message)), true);
addEventListener("securitypolicyviolation", event => errors.push(event.blockedURI));
addEventListener("load", () => {
  const images = [...document.images].map(image => [image.naturalWidth, image.getBoundingClientRect().width]);
  const loaded = performance.getEntriesByType("resource").map(entry => entry.name);
  const fetched = loaded.filter(name => !name.startsWith("data:"));
  const overflow = document.documentElement.scrollWidth - innerWidth;
  document.body.dataset.probe = JSON.stringify({images, fetched, overflow, errors});
});
</script></head>"""
pytestmark = [pytest.mark.slow,
              pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here (Debian: apt-get install chromium)")]


def browse(page, profile, width):
    """Return what the browser made of a page, and what it said."""
    command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr", "--dump-dom",
               f"--user-data-dir={profile}", f"--window-size={width},900", page.as_uri()]
    run = subprocess.run(command, capture_output=True, text=True, timeout=120)
    return run.stdout, [line for line in run.stderr.splitlines() if ":CONSOLE" in line]


@pytest.fixture
def page(laboratory, tmp_path, monkeypatch):
    monkeypatch.chdir(laboratory)
    return write_report("runs", tmp_path / "report.html")


def test_chromium_complains_about_nothing_but_would(page, tmp_path):
    assert browse(page[0], tmp_path / "profile", 1280)[1] == []
    text = page[0].read_text()
    page[0].write_text(text.replace("</body>", "<img src='https://example.invalid/x.png'><script>1</script></body>"))
    said = "\n".join(browse(page[0], tmp_path / "profile", 1280)[1])
    assert "https://example.invalid/x.png" in said
    assert "inline script" in said


@pytest.mark.parametrize("width", [1280, 500])
def test_figures_are_visible_and_nothing_is_fetched(page, tmp_path, width):
    path, sections = page
    text = re.sub(r'<meta http-equiv="Content-Security-Policy"[^>]*>', "", path.read_text(), count=1)
    path.write_text(text.replace("</head>", PROBE, 1))  # the same page, allowed to run our script
    shown, said = browse(path, tmp_path / "profile", width)
    found = json.loads(unescape(re.search(r'data-probe="([^"]*)"', shown)[1]))
    assert (found["fetched"], found["errors"], said) == ([], [], [])
    assert len(found["images"]) == sum(len(section.figures) for section in sections) >= 5
    assert all(natural > 0 and width > 50 for natural, width in found["images"])
    assert found["overflow"] <= 0
