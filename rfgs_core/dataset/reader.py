# SPDX-License-Identifier: Apache-2.0
"""Opens datasets: everything is read lazily and checked when read."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from functools import cached_property
from pathlib import Path

from rfgs_core.dataset.impaired_store import IMPAIRED, is_of_impaired
from rfgs_core.dataset.observed import Observed
from rfgs_core.dataset.schema import DatasetInfo, read_dataset_info
from rfgs_core.dataset.sequence import Sequence
from rfgs_core.dataset.writer import MANIFEST, info_text
from rfgs_core.errors import RfgsError
from rfgs_core.files import inside, sha256


def open_dataset(path: Path | str) -> Dataset:
    """Opens a finished dataset.

    Args:
        path: Folder that holds `dataset.json`.

    Returns:
        The dataset; sequences are opened with `Dataset.sequence`.

    Raises:
        RfgsError: There is no dataset, it is unfinished or of a newer schema; or the path is an
            address of object storage, from which xarray reads channels but nothing reads
            pictures and geometry.
        RfgsFormatError: `dataset.json` does not keep to its schema.
    """
    if "://" in str(path):
        raise RfgsError(
            f"{path}: datasets are opened from folders; copy it with `fsspec` or your storage's "
            "own tool, or read its channels in place: xarray.open_zarr("
            f"'{str(path).rstrip('/')}/SEQUENCE/radio/RADIO/csi.zarr', consolidated=False)"
        )
    path = Path(path)
    file = path / "dataset.json"
    try:
        there = file.is_file()
    except OSError as error:
        # Names that no file system has, as a damaged run may give.
        raise RfgsError(f"{str(path)[:200]}: no dataset there ({error.strerror})") from error
    if not there:
        raise RfgsError(f"{path}: no dataset there; expected a folder with dataset.json")
    info = read_dataset_info(file)
    if not info.manifest_sha256:
        raise RfgsError(
            f"{path}: this dataset is unfinished; run the same rfgs-factory generate again"
        )
    return Dataset(path, info)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


class Dataset:
    """A finished dataset on disk."""

    def __init__(self, path: Path, info: DatasetInfo) -> None:
        self.path = path
        self.info = info

    @property
    def sequences(self) -> list[str]:
        """Names of the sequences."""
        return list(self.info.sequences)

    @property
    def has(self) -> list[str]:
        """What is present, some of `schema.CONTENTS`: for example csi, csi_static, images."""
        return list(self.info.has)

    @cached_property
    def fingerprint(self) -> str:
        """Digest that identifies the data: of `dataset.json`, which holds the manifest's."""
        return sha256(self.path / "dataset.json")

    @cached_property
    def clean_fingerprint(self) -> str:
        """The `fingerprint` without impaired channels, as it was before they were added."""
        manifest = self.path / MANIFEST
        if IMPAIRED not in self.has or not manifest.is_file():
            return self.fingerprint
        if sha256(manifest) != self.info.manifest_sha256:
            # Whatever it names is not what this dataset was sealed with.
            return self.fingerprint
        lines = manifest.read_text("utf-8").splitlines(keepends=True)
        rest = "".join(line for line in lines if not is_of_impaired(line))
        has = [name for name in self.has if name != IMPAIRED]
        info = replace(self.info, has=has, manifest_sha256=_digest(rest))
        return _digest(info_text(info))

    def fingerprints(self, channel: Observed) -> tuple[str, ...]:
        """Every digest by which a run on a channel may know this dataset, today's first.

        Impairments are no part of what a run on clean channels was trained on; runs before this was
        so know the digest of everything.
        """
        if channel == "clean":
            return self.clean_fingerprint, self.fingerprint
        return (self.fingerprint,)

    def sequence(self, name: str | None = None) -> Sequence:
        """Opens a sequence.

        Args:
            name: Which one; None opens the only one.

        Raises:
            RfgsError: The name is unknown, or none was given and there are several.
        """
        if name is None:
            if len(self.sequences) != 1:
                raise RfgsError(
                    f"{self.path}: ambiguous sequence: it holds {', '.join(self.sequences)}; "
                    "choose one with --sequence"
                )
            name = self.sequences[0]
        if name not in self.sequences:
            raise RfgsError(
                f"{self.path}: no sequence {name!r}; expected one of {', '.join(self.sequences)}"
            )
        return Sequence(inside(self.path, name), name)

    def need(self, *contents: str) -> None:
        """Refuses to go on without some contents.

        Raises:
            RfgsError: The dataset lacks one of `contents`.
        """
        missing = [name for name in contents if name not in self.info.has]
        if missing:
            remedy = "; it has them if made by `rfgs-factory generate --paths`"
            raise RfgsError(
                f"{self.path}: this dataset holds no {', '.join(missing)}"
                f"{remedy if missing == ['paths'] else ''}"
            )
