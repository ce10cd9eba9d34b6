"""Translation of any picture of a scene to its canonical view.

In: paired views (`vision_s2r.render`), a camera to draw effects from in training and one to choose the checkpoint by.
Out: a translator, `Translator.load(path)(images)`: uint8 [B, H, W, 3] or float [B, 3, H, W], the same form back.
"""

from vision_s2r.translate.config import TranslateConfig
from vision_s2r.translate.rcan import train_translator
from vision_s2r.translate.translator import Translator

__all__ = ["TranslateConfig", "Translator", "train_translator"]
