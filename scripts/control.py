"""Control across the dynamics gap: `python scripts/control.py follow|ablate|adr [KEY=VALUE …]`.

follow: policies trained on the wrong simulator and on randomized ones, in reality; ablate: what each randomization is
worth; adr: automatic domain randomization. Sizes: control=full|small|debug.
"""

from vision_s2r.commands.main import main

if __name__ == "__main__":
    main("control")
