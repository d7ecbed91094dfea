# SPDX-License-Identifier: Apache-2.0
"""Opens datasets: everything is read lazily and checked when read."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path

from rfgs_core.dataset.schema import DatasetInfo, read_dataset_info
from rfgs_core.dataset.sequence import Sequence
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
