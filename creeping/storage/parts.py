"""Results that are computed part by part: what is stored of them is whole or absent, whenever the process ends.

A result is a folder of its own below the one that the caller names, called by the digest of all that it depends on:
several processes may fill one folder. A part is a folder of arrays (`creeping.storage.folder`); a damaged one is
computed anew.
"""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np

from creeping._typing import Any
from creeping.errors import StoredMapError
from creeping.storage.folder import content_digest, open_array, read_manifest, remove_folder, write_folder

Arrays = dict[str, np.ndarray[Any, Any]]
Keeping = Callable[[str, Callable[[], Arrays]], Arrays]
"""Arrays of a part by its name: stored ones, or those that the function makes, which are stored then."""


def not_kept(_: str, make: Callable[[], Arrays]) -> Arrays:
    """Arrays without a store."""
    return make()


class Parts:
    """Parts of one result, kept in a folder; called as `Keeping`.

    Parameters
    ----------
    folder : path
        Of many results.
    key : dict
        All that this one depends on, as json takes it.
    """

    def __init__(self, folder: str | Path, key: dict[str, Any]) -> None:
        self.key: dict[str, Any] = json.loads(json.dumps(key))
        self.folder = Path(folder) / content_digest(self.key)[:32]

    def __call__(self, name: str, make: Callable[[], Arrays]) -> Arrays:
        """Arrays of a part.

        Raises
        ------
        StoredMapError
            If they cannot be written.
        """
        place = self.folder / name
        found = self._stored(place)
        if found is None:
            found = make()
            try:
                arrays = {f"{part}.npy": np.ascontiguousarray(values) for part, values in found.items()}
                write_folder(place, {"key": self.key}, arrays)
            except StoredMapError:
                # another process may have computed the same meanwhile
                if self._stored(place) is None:
                    raise
        return found

    def _stored(self, place: Path) -> Arrays | None:
        if not place.exists():
            return None
        try:
            content = read_manifest(place)
            if content["key"] != self.key:
                raise StoredMapError(f"{place} is of another result")
            return {name.removesuffix(".npy"): open_array(place, name, content) for name in content["files"]}
        except (StoredMapError, KeyError):
            remove_folder(place)
            shutil.rmtree(place, ignore_errors=True)
            return None

    def forget(self, but: str) -> None:
        """Remove all parts but one, which holds what they were for."""
        for place in self.folder.iterdir() if self.folder.exists() else ():
            if place.name != but:
                shutil.rmtree(place, ignore_errors=True)
