"""What happens when things go wrong: spoilt inputs, commands that are killed; counted, and tabled.

`vision-s2r reliability` does it to readers and commands as they are.
"""

from vision_s2r.reliability.config import ReliabilityConfig
from vision_s2r.reliability.run import reliability

__all__ = ["ReliabilityConfig", "reliability"]
