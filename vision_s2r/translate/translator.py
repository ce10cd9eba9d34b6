"""A trained translator, which is all that another program needs."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import torch
from torch import Tensor

from vision_s2r.errors import UserError
from vision_s2r.images import to_float, to_uint8
from vision_s2r.networks.unet import NetworkConfig, UNet
from vision_s2r.scene import palette
from vision_s2r.training import checkpoint

CHUNK = 64  # pictures at a time


def network_of(path: str | Path) -> NetworkConfig:
    """The size of a released translator's network. Raises UserError where it is none."""
    found = checkpoint.load(path, "translator")
    with _configured(path):
        return _size(found)


def _size(found: checkpoint.Checkpoint) -> NetworkConfig:
    return NetworkConfig(**found.configuration["network"])


@contextmanager
def _configured(path: str | Path) -> Iterator[None]:
    """UserError for whatever a configuration that is no translator's raises."""
    try:
        yield
    except UserError as error:
        raise UserError(f"{path}: {error}") from error
    except (LookupError, TypeError, ValueError, ArithmeticError, AttributeError) as error:
        raise UserError(f"{path}: its configuration is no translator's ({error!r})") from error


class Translator:
    """Pictures of a scene to its canonical view: `Translator.load(path)(images)`."""

    def __init__(self, network: UNet, size: int, depth_range: tuple[float, float] | None):
        """`size`: side of the pictures that it was trained on, px.

        `depth_range`: nearest and farthest depth (m), which the network gives as 0 and 1, if it gives any.
        """
        self.size = size
        self.network = network.eval().requires_grad_(False)
        self._depth_range = depth_range

    @classmethod
    def load(cls, path: str | Path, device: str | torch.device = "cpu") -> "Translator":
        """The translator of a released checkpoint: a file, or a name in the package such as "bin-64".

        Raises UserError where it is none, or was trained for another canonical look.
        """
        found = checkpoint.load(path, "translator")
        with _configured(path):
            network = UNet(_size(found), found.configuration["heads"])
            size, colours = int(found.normalization["size"]), found.normalization["palette"]
            depth_range = tuple(found.normalization["depth_range"]) if "depth" in network.heads else None
        if colours != [list(colour) for colour in palette()]:
            raise UserError(f"{path}: its canonical colours are {colours}: expected those of this scene, {palette()}")
        found.restore("unet", network)
        network.to(device, memory_format=torch.channels_last)  # type: ignore[call-overload]
        return cls(network, size, depth_range)

    def __call__(self, images: Tensor, mirrored: bool = False) -> Tensor:
        """The canonical views of pictures, in their form and on their device.

        mirrored: the mean with the translation of the mirror image, mirrored back; twice the time.

        uint8 [B, H, W, 3] gives uint8 [B, H, W, 3]; float [B, 3, H, W] in [0, 1] gives float32 [B, 3, H, W] in
        [0, 1]; H and W are `size`. Raises UserError for anything else.
        """
        canonical = self.predict(images)["canonical"]
        if mirrored:
            across = -2 if images.dtype == torch.uint8 else -1
            canonical = (canonical + self.predict(images.flip(across))["canonical"].flip(-1)) / 2
        return to_uint8(canonical) if images.dtype == torch.uint8 else canonical

    def predict(self, images: Tensor) -> dict[str, Tensor]:
        """All that the network says about pictures as `__call__` takes them, on their device.

        `canonical` float [B, 3, H, W] in [0, 1]; and, where it was trained on them, `segmentation` float
        [B, C, H, W], probabilities of `vision_s2r.scene.CLASSES`, and `depth` float [B, H, W] in metres.
        """
        pictures = self._checked(images)
        parts = [self._predict(part) for part in pictures.split(CHUNK)]
        return {name: torch.cat([part[name] for part in parts]).to(images.device) for name in parts[0]}

    @torch.no_grad()
    def _predict(self, images: Tensor) -> dict[str, Tensor]:
        return self.read(self.network(images.to(next(self.network.parameters()).device)))

    def read(self, output: dict[str, Tensor]) -> dict[str, Tensor]:
        """What `predict` gives, of what the network gave."""
        found = {"canonical": output["canonical"].clamp(0, 1)}
        if "segmentation" in output:
            found["segmentation"] = output["segmentation"].softmax(1)
        if self._depth_range is not None:
            near, far = self._depth_range
            found["depth"] = near + (far - near) * output["depth"][:, 0]
        return found

    def _checked(self, images: Tensor) -> Tensor:
        """Pictures in either form as float32 [B, 3, H, W]."""
        if not isinstance(images, Tensor):
            raise UserError(f"translator: pictures are a {type(images).__name__}: expected a torch.Tensor")
        what = f"translator: pictures of type {images.dtype} and shape {tuple(images.shape)}"
        channels = -1 if images.dtype == torch.uint8 else 1
        kind = images.dtype == torch.uint8 or images.is_floating_point()
        if not kind or images.ndim != 4 or images.shape[channels] != 3 or not len(images):
            raise UserError(f"{what}: expected uint8 [B, H, W, 3], or float [B, 3, H, W] in [0, 1]")
        if images.dtype == torch.uint8:
            images = to_float(images)
        elif not (images.amin() >= 0 and images.amax() <= 1):
            raise UserError(f"{what} with values outside [0, 1]: expected [0, 1], or uint8 [B, H, W, 3]")
        if images.shape[-2:] != (self.size, self.size):
            raise UserError(f"{what}: expected {self.size} x {self.size} px, which it was trained on")
        return images.float()
