"""Makers of recordings are shared: with this file here its folder is on the path of every test."""

import gc


def pytest_collection_finish() -> None:
    """What was imported stays, and need not be looked through for garbage again and again."""
    gc.freeze()
