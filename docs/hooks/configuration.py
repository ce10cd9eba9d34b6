"""The reference of every configuration key."""

from vision_s2r.config_reference import config_reference


def pages() -> dict[str, str]:
    """Pages in Markdown by name: a configuration or a part of one, with the files of its group."""
    return config_reference()
