"""What is cheap to know of the damage to a store: its small files by their digests.

The study of a store lists the digests of all files that are the same from its beginning to its end: what describes
each array, and the coordinates. What describes the root changes with the counts of incidences; its attributes have a
digest among them.
"""

import hashlib
import json
from pathlib import Path

from creeping._typing import Any
from creeping.storage.folder import content_digest
from creeping.storage.reading import bytes_of, opened

ROOT, STUDY, STUDY_FILE = "zarr.json", "study", "study/zarr.json"
MOST_DOCUMENT = 10**9
"""Bytes."""
SEAL = "attributes_blake2b"
"""Attribute of the root that holds the digest of the others."""


def read_document(file: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """What zarr keeps in a file: attributes, and the rest.

    Raises
    ------
    OSError, ValueError
        If it cannot be read, or is something else.
    """
    document = json.loads(bytes_of(file, MOST_DOCUMENT))
    if not isinstance(document, dict) or not isinstance(document.get("attributes"), dict):
        raise ValueError("no attributes are in it")
    return document.pop("attributes"), document


def sealed(attributes: dict[str, Any]) -> dict[str, Any]:
    """Attributes with their digest among them."""
    plain = {name: value for name, value in attributes.items() if name != SEAL}
    return plain | {SEAL: content_digest(plain)}


def file_digests(folder: Path) -> dict[str, str]:
    """Digests of the files of an empty store by their paths; of the root and the study without their attributes."""
    found = {}
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        name = path.relative_to(folder).as_posix()
        found[name] = content_digest(read_document(path)[1]) if name in (ROOT, STUDY_FILE) else _digest(path)
    return found


def damaged_files(folder: Path, known: dict[str, str]) -> list[str]:
    """Files of a store that are not what they were, by their paths."""
    return [name for name, digest in known.items() if not is_whole(folder, name, digest)]


def is_whole(folder: Path, name: str, digest: str) -> bool:
    """Whether a file of a store is what it was; the attributes of the study have a digest of their own."""
    try:
        if name not in (ROOT, STUDY_FILE):
            return _digest(folder / name) == digest
        attributes, rest = read_document(folder / name)
        return content_digest(rest) == digest and (name != ROOT or attributes == sealed(attributes))
    except (OSError, ValueError, RecursionError):
        return False


def _digest(path: Path) -> str:
    with opened(path) as stream:
        return hashlib.file_digest(stream, lambda: hashlib.blake2b(digest_size=16)).hexdigest()
