"""Trained networks for other programs: ONNX with a card and a configuration beside it.

In: a released checkpoint. Out: NAME.onnx (any number of pictures), NAME.json (what goes in and comes out, what it was
trained as) and NAME.md (its card). Needs the packages of the extra `export`.
"""

from vision_s2r.export.config import ExportConfig
from vision_s2r.export.onnx import export_policy, export_translator

__all__ = ["ExportConfig", "export_policy", "export_translator"]
