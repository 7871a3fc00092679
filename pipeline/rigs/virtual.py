"""Base class of the campaigns of virtual benches, the sources of `acquire`."""

from abc import ABC, abstractmethod
from pathlib import Path
from typing import Any

from unmodelled.base.files import replacing_folder


class VirtualCampaign(ABC):
    """A campaign that a virtual bench runs instead of a real machine."""

    @property
    @abstractmethod
    def description(self) -> str:
        """Sentence on what the raw logs are."""

    @property
    def more(self) -> dict[str, Any]:
        """Further facts for the provenance: none, unless a subclass has some."""
        return {}

    @abstractmethod
    def make(self, out: Path, seed: int) -> int:
        """Write the raw logs, and return the number of experiments.

        Args:
            out: empty folder.
            seed: seed of the random generator.
        """

    def write(self, folder: Path, seed: int) -> dict[str, Any]:
        """Replace a folder by the raw logs, and return the provenance.

        Args:
            folder: folder that is replaced as a whole.
            seed: seed of the random generator.

        Raises:
            BadInput: when the disk is full or the folder cannot be written.
        """
        with replacing_folder(folder) as out:
            count = self.make(out, seed)
        about = {"data": "virtual", "description": self.description, **self.more}
        return {**about, "seed": seed, "experiments": count}
