"""Fitted bodies on disk: a file of arrays and a text, never executed, with a digest of all of it.

Files lie in $CREEPING_CACHE/fits, or ``fits`` in the user's cache folder.
"""

import contextlib
import hashlib
import io
import json
import os
import re
import tempfile
import zlib
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from creeping._typing import FloatArray
from creeping.kernels.cache import private_folder, require_private

SCHEMA = 16
"""Counts up with every change of what is stored or of how it is fitted."""
DIGEST = 32
NAME = re.compile(r"[a-z]+-[0-9a-f]{24}\.npz")


def cache_folder() -> Path:
    """Folder of the fits."""
    import platformdirs

    named = os.environ.get("CREEPING_CACHE")
    return (Path(named) if named else platformdirs.user_cache_path("creeping")) / "fits"


def key_of(kind: str, content: bytes, **parameters: Any) -> str:
    """Name of a fit: changes with the source's content and the parameters."""
    digest = hashlib.blake2b(digest_size=12)
    digest.update(json.dumps([SCHEMA, kind, parameters], sort_keys=True).encode() + b"\0")
    digest.update(content)
    return f"{kind}-{digest.hexdigest()}"


def load(folder: Path, key: str) -> tuple[dict[str, FloatArray], dict[str, Any]] | None:
    """Arrays and text of a fit, None if it is not there, damaged, of another kind, or others could have written it."""
    file = folder / f"{key}.npz"
    try:
        for path in (folder, file):
            require_private(path)
        whole = file.read_bytes()
        if hashlib.blake2b(whole[DIGEST:], digest_size=DIGEST).digest() != whole[:DIGEST]:
            return None
        with np.load(io.BytesIO(whole[DIGEST:]), allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files}
        text = json.loads(arrays.pop("text").tobytes())
    except (OSError, ValueError, KeyError, AttributeError, EOFError, BadZipFile, zlib.error):
        return None
    return arrays, text


def store(folder: Path, key: str, arrays: dict[str, FloatArray], text: dict[str, Any]) -> str:
    """Write a fit aside and rename it into place; what hindered it, empty if nothing did."""
    packed = io.BytesIO()
    named: dict[str, Any] = {"text": np.frombuffer(json.dumps(text).encode(), dtype=np.uint8), **arrays}
    np.savez(packed, **named)
    content = packed.getvalue()
    aside = None
    try:
        private_folder(folder)
        with tempfile.NamedTemporaryFile(dir=folder, prefix=".writing-", delete=False) as file:
            aside = Path(file.name)
            file.write(hashlib.blake2b(content, digest_size=DIGEST).digest() + content)
        aside.replace(folder / f"{key}.npz")
    except OSError as error:
        with contextlib.suppress(OSError):
            if aside is not None:
                aside.unlink(missing_ok=True)
        return f"the fit is not cached: {error}"
    return ""
