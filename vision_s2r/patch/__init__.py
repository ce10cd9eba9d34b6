"""What a report names, as something to build into a simulator: from a report to configuration files.

`patch.write_patch` writes all formats. How an effect is written is said in `effects/NAME.py`.
"""
