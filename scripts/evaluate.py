"""Measure the transfer table: CSV, JSON and one page."""

from vision_s2r.commands.main import main

if __name__ == "__main__":
    main("evaluate")
