"""The generator: draws machines, simulates them with code of its own, and writes recordings and withheld answers."""
