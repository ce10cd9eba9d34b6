"""The diagnosed effects, as other programs take them: for each format, the effects that it can express."""

from vision_s2r.patch.patch import write_patch

__all__ = ["write_patch"]
