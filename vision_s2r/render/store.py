"""A store that all nodes reach, where shards go: any address of fsspec."""

from pathlib import Path

import fsspec

from vision_s2r.errors import UserError
from vision_s2r.files import whole
from vision_s2r.render import shard as shards
from vision_s2r.render.manifest import NAME, Manifest, shard_path


class Store:
    """Files of one set of renders, under their names in its folder. Raises UserError where it cannot be reached."""

    def __init__(self, address: str) -> None:
        try:
            self._files, self._root = fsspec.core.url_to_fs(address)
        except (ImportError, ValueError, OSError) as error:
            raise UserError(f"render.store = {address}: {error}") from error
        self._address = address

    def push(self, path: Path) -> None:
        """Send a file."""
        try:
            self._files.makedirs(self._root, exist_ok=True)
            self._files.put_file(str(path), self._there(path))
        except OSError as error:
            raise UserError(f"{self._address}: {path.name} cannot be written ({error})") from error

    def fetch(self, folder: Path) -> None:
        """Bring the manifest where the folder has none, and the shards that it lists and the folder lacks."""
        if not (folder / NAME).exists() and self._files.exists(self._there(folder / NAME)):
            self._pull(folder / NAME)
        if (folder / NAME).exists():
            self.complete(folder, Manifest.load(folder))

    def complete(self, folder: Path, manifest: Manifest) -> None:
        """Bring the shards that the manifest lists and the folder lacks: other nodes made them."""
        for number, digest in manifest.checksums.items():
            path = shard_path(folder, number)
            lacks = not path.is_file() or shards.checksum(path) != digest
            if lacks and self._files.exists(self._there(path)):
                self._pull(path)

    def _pull(self, path: Path) -> None:
        with whole(path) as temporary:
            self._files.get_file(self._there(path), str(temporary))

    def _there(self, path: Path) -> str:
        return f"{self._root.rstrip('/')}/{path.name}"
