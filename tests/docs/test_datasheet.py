# SPDX-License-Identifier: Apache-2.0
"""docs/dataset.md names every field there is, its examples run, and the tests it cites exist."""

from __future__ import annotations

import re
import shutil
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from rfgs_core.dataset import Sequence, open_dataset
from rfgs_core.dataset.schema import CONTENTS, DatasetInfo, SequenceInfo
from rfgs_core.files import read_json
from rfgs_core.radio import PRESETS, Radio
from rfgs_core.radio.path_table import PathTable
from rfgs_core.skeleton import JOINTS

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs" / "dataset.md").read_text("utf-8")
RADIOS = (ROOT / "docs" / "radios.md").read_text("utf-8")
_FENCES = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def code_words(text: str) -> set[str]:
    """Words that stand in code spans and blocks of Markdown."""
    blocks = [code for _, code in _FENCES.findall(text)]
    spans = re.findall(r"`([^`\n]+)`", _FENCES.sub("", text))
    return set(re.findall(r"[\w-]+", " ".join([*blocks, *spans])))


@pytest.fixture(scope="module")
def impaired(tiny_dataset: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The tiny dataset with impaired channels."""
    from dataset_factory.make.impair import impair_dataset
    from rfgs_core.radio.impairments import IMPAIRMENT_PRESETS

    path = tmp_path_factory.mktemp("datasheet") / "my_dataset"
    shutil.copytree(tiny_dataset, path)
    impair_dataset(path, IMPAIRMENT_PRESETS["lab"])
    return path


def stored_names(path: Path) -> set[str]:
    """Names of everything a dataset's files hold."""
    sequence = open_dataset(path).sequence()
    names = {str(name) for name in sequence.radio("wifi").variables}
    names |= set(sequence.radio("wifi").attrs) | set(sequence.radio("wifi").dims)
    names |= {key for row in (*sequence.cameras, *sequence.info.devices["wifi"]) for key in row}
    for file in (sequence.files.geometry(1), sequence.files.topology):
        with np.load(file) as arrays:
            names |= set(arrays)
    transforms = read_json(sequence.files.transforms("train"))
    names |= {spec.name for spec in fields(PathTable)}
    return names | {*transforms, *transforms["frames"][0], *read_json(path / "dataset.json")}


def test_every_stored_name_is_explained(impaired: Path) -> None:
    names = {spec.name for kind in (DatasetInfo, SequenceInfo) for spec in fields(kind)}
    names |= {*CONTENTS, *PRESETS, *stored_names(impaired), "sample_index"}
    assert not sorted(names - code_words(TEXT))
    assert not sorted({spec.name for spec in fields(Radio)} - code_words(RADIOS))


def test_every_method_of_the_reader_is_named() -> None:
    public = {name for name in vars(Sequence) if not name.startswith("_")}
    assert not sorted(public - code_words(TEXT))


def test_every_command_and_format_is_named() -> None:
    from dataset_factory.cli import COMMANDS
    from dataset_factory.convert import FORMATS

    assert not sorted({*COMMANDS, *FORMATS} - code_words(TEXT))


def test_joints_stand_in_their_order() -> None:
    assert ", ".join(JOINTS) in " ".join(TEXT.split())


def test_readme_agrees() -> None:
    readme = (ROOT / "README.md").read_text("utf-8")
    section = readme.split("## The dataset")[1].split("\n## ")[0]
    scenes = {row["name"] for row in read_json(ROOT / "blender_scenes" / "catalogue.json")}
    spans = {span for span in re.findall(r"`([^`\n]+)`", section) if re.fullmatch(r"\w+", span)}
    assert {*scenes, *PRESETS} <= spans
    assert not sorted(spans - scenes - code_words(TEXT))


def test_cited_tests_and_files_exist() -> None:
    tests = "\n".join(file.read_text("utf-8") for file in (ROOT / "tests").rglob("test_*.py"))
    cited = set(re.findall(r"`(test_\w+)`", TEXT))
    assert len(cited) > 15
    assert not sorted(name for name in cited if f"def {name}(" not in tests)
    links = [link for link in re.findall(r"\]\(([^)#]+)\)", TEXT) if "://" not in link]
    files = [ROOT / name for name in re.findall(r"`((?:\w+/)+\w+\.py)`", TEXT)]
    assert links and files
    assert not [link for link in links if not (ROOT / "docs" / link).exists()]
    assert not [file for file in files if not file.is_file()]


def test_examples_run(impaired: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    examples = [code for language, code in _FENCES.findall(TEXT) if language == "python"]
    assert len(examples) >= 5
    monkeypatch.chdir(impaired.parent)
    names: dict[str, object] = {}
    for code in examples:
        exec(compile(code, "docs/dataset.md", "exec"), names)
    sequence = names["sequence"]
    assert isinstance(sequence, Sequence)
    restored, clean = np.asarray(names["clean"]), sequence.csi_samples("wifi", 1)
    assert np.abs(restored - clean).max() < 0.02 * np.abs(clean).max()
