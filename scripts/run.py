"""The whole way: render, train, evaluate; goes on where it was interrupted. `experiment=demo|cpu|full|debug`."""

from vision_s2r.commands.main import main

if __name__ == "__main__":
    main("run")
