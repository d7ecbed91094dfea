# SPDX-License-Identifier: Apache-2.0
"""The site builds, its links and those of the README lead somewhere, and the README is short."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

import rfgs_core

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text("utf-8")
RESULTS = sorted((ROOT / "docs" / "results").glob("*.md"))


def build(folder: Path, site: Path) -> subprocess.CompletedProcess[str]:
    """Builds the site of a folder as `make docs` does."""
    return subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(site)],
        cwd=folder,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


def anchors(file: Path) -> set[str]:
    """Where links into a page of Markdown may lead, as GitHub names headings."""
    text = re.sub(r"^```.*?^```$", "", file.read_text("utf-8"), flags=re.MULTILINE | re.DOTALL)
    headings = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    kept = [re.sub(r"[^\w\- ]", "", heading.lower()) for heading in headings]
    return {heading.strip().replace(" ", "-") for heading in kept}


def test_the_site_builds_with_its_api(tmp_path: Path) -> None:
    done = build(ROOT, tmp_path / "site")
    assert done.returncode == 0, done.stderr[-3000:]
    api = (tmp_path / "site" / "api.html").read_text("utf-8")
    for name in set(rfgs_core.__all__) - {"__version__"}:
        assert re.search(rf'id="rfgs_core[\w.]*\.{name}"', api), name
    # Somebody without a network reads it too.
    home = (tmp_path / "site" / "index.html").read_text("utf-8")
    assert not re.findall(r'<(?:script|link|img)[^>]+(?:src|href)="https?://', home)


@pytest.mark.parametrize("link", ["[gone](gone.md)", "[gone](glossary.md#gone)"])
def test_a_broken_link_ends_the_build(tmp_path: Path, link: str) -> None:
    (tmp_path / "docs").mkdir()
    shutil.copy(ROOT / "docs" / "glossary.md", tmp_path / "docs")
    (tmp_path / "docs" / "index.md").write_text(f"# Start\n\n{link}\n", "utf-8")
    settings = yaml.safe_load((ROOT / "mkdocs.yml").read_text("utf-8"))
    kept = {name: settings[name] for name in ("site_name", "docs_dir", "validation")}
    (tmp_path / "mkdocs.yml").write_text(yaml.safe_dump(kept), "utf-8")
    done = build(tmp_path, tmp_path / "site")
    assert done.returncode == 1 and "gone" in done.stderr, done.stderr[-3000:]


def test_every_page_is_in_the_menu() -> None:
    settings = yaml.safe_load((ROOT / "mkdocs.yml").read_text("utf-8"))
    menu = set(re.findall(r"[\w/]+\.(?:md|ipynb)", str(settings["nav"])))
    docs = ROOT / "docs"
    pages = [file for file in docs.rglob("*") if file.suffix in (".md", ".ipynb")]
    assert menu == {file.relative_to(docs).as_posix() for file in pages}


def test_results_are_short_and_their_summary_leads_to_every_page() -> None:
    summary = (ROOT / "docs" / "results.md").read_text("utf-8")
    assert len(summary.splitlines()) <= 120
    assert RESULTS
    for page in RESULTS:
        assert f"(results/{page.name}" in summary, page.name
        text = page.read_text("utf-8")
        assert len(text.splitlines()) <= 250, page.name
        prose = [x for x in text.splitlines() if not x.startswith(("|", "    ", "!["))]
        assert max(map(len, prose)) <= 120, page.name


def test_figures_of_the_summary_stand_on_the_pages_it_links() -> None:
    summary = (ROOT / "docs" / "results.md").read_text("utf-8")
    table = summary[summary.index("## Summary") : summary.index("## Where it loses")]
    checked = 0
    for row in table.splitlines():
        question, *figures = row.strip("|").split("|")
        linked = re.findall(r"\]\((results/\w+\.md)", row)
        if not linked:
            continue
        text = (ROOT / "docs" / linked[0]).read_text("utf-8")
        known = set(re.findall(r"\d+\.\d+", text))
        for number in re.findall(r"\d+\.\d+", " ".join(figures[:3])):
            assert {number, number.rstrip("0")} & known, f"{question.strip()}: {number}"
            checked += 1
    assert checked > 80


@pytest.mark.parametrize(
    "page",
    [
        "README.md",
        "DEVELOPMENT.md",
        "docs/method.md",
        "docs/results.md",
        *(f"docs/results/{page.name}" for page in RESULTS),
    ],
)
def test_links_lead_somewhere(page: str) -> None:
    file = ROOT / page
    links = [x for x in re.findall(r"\]\(([^)\s]+)\)", file.read_text("utf-8")) if "://" not in x]
    for link in links:
        name, _, anchor = link.partition("#")
        target = file.parent / name if name else file
        assert target.exists(), link
        assert not anchor or anchor in anchors(target), link


def test_the_readme_is_short_and_moves() -> None:
    assert len(README.splitlines()) <= 130
    picture = re.search(r"!\[.*?\]\((docs/\S+?\.(?:webp|gif))\)", README)
    assert picture and (ROOT / picture[1]).stat().st_size < 2_000_000
    assert "make demo" in README and "make test" in README


def test_measurements_stay_out_of_the_method() -> None:
    method = (ROOT / "docs" / "method.md").read_text("utf-8")
    assert not re.findall(r"\bat [0-9a-f]{7}\b|\*[Mm]easured\*|20\d\d-\d\d-\d\d", method)
    for gone in ("--coarse", "--settle", "--power-trust"):
        assert gone not in method + README


def test_words_are_those_of_the_field() -> None:
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    for page in pages:
        text = page.read_text("utf-8")
        assert not re.findall(r"\b[Tt]ones?\b|told apart|own links|\brivals?\b", text), page
