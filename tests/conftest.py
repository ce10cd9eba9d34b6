"""Here so that this folder is on the path of every test: makers of recordings are shared."""
