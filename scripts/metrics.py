"""What translations do to pictures, and which metric foretells success: `tables='[DIR, …]' out=DIR`."""

from vision_s2r.commands.main import main

if __name__ == "__main__":
    main("metrics")
