"""Real-looking renders as cameras deliver them."""

from collections.abc import Callable, Sequence

import torch
from torch import Tensor

from vision_s2r.camera import Camera, sources
from vision_s2r.images import reduced, to_uint8
from vision_s2r.render.views import Views
from vision_s2r.threads import one_thread

Draw = Callable[[list[int]], torch.Generator]  # of a scene's seed and index


def through(views: Views, source: Tensor, camera: Camera, draw: Draw) -> Tensor:
    """Source pictures uint8 [N, H+2m, W+2m, 3] of the views' scenes through a camera: uint8 [N, H, W, 3].

    Each is a function of its scene and `draw` alone, pixel for pixel, whatever other scenes there are.
    """
    size, margin, intrinsics = views.source_size, views.margin, views.all("intrinsics")
    seen = []
    with one_thread():  # several lose more in handing over such small pictures than they gain
        # One by one: convolutions over a batch differ in the last bit with the size of the batch.
        for i, scene in enumerate(views.all("seed_and_index").tolist()):
            parameters = camera.sample(1, draw(scene), size, size)
            one = slice(i, i + 1)
            seen.append(to_uint8(sources.seen(camera, source[one], parameters, margin, intrinsics[one], views.size)))
    return torch.cat(seen)


class Recorded:
    """Views of the real look as a robot's log has them: a picture `seen` of each scene, and no more than is logged.

    The pictures are as networks read them: of as many pixels as canonical ones.

    A source of views for training (`vision_s2r.training.ViewSource`). Neither canonical pictures nor segmentation or
    depth are there; intrinsics, extrinsics (the nominal camera's), grasps and their success are.
    """

    names = frozenset({"seen", "intrinsics", "extrinsics", "grasps", "success"})
    margin = 0

    def __init__(self, views: Views, seen: Tensor) -> None:
        """`seen`: uint8 [N, H, W, 3]."""
        self._views, self._seen = views, seen
        self.size = self.source_size = views.size

    @classmethod
    def by(cls, views: Views, cameras: Sequence[Camera], draw: Draw) -> "Recorded":
        """Scene i recorded by camera i modulo their number: as many robots, each with a camera of its own."""
        pictures = torch.empty(len(views), views.size, views.size, 3, dtype=torch.uint8)
        for k, camera in enumerate(cameras):
            some = torch.arange(k, len(views), len(cameras))
            part = views.subset(some)
            pictures[some] = reduced(through(part, part.all("real"), camera, draw), views.size)
        return cls(views, pictures)

    def __len__(self) -> int:
        return len(self._views)

    def batch(self, name: str, indices: Tensor) -> Tensor:
        """Rows `indices` [B] of a tensor, [B, ...]."""
        return self._seen[indices] if name == "seen" else self._views.batch(name, indices)

    def first(self, count: int) -> "Recorded":
        """The first scenes alone."""
        return Recorded(self._views.subset(range(count)), self._seen[:count])

    def replaced(self, seen: Tensor) -> "Recorded":
        """The same scenes with other pictures, for instance their translations."""
        return Recorded(self._views, seen)
