"""The command line: one table of commands, what each does, and which configuration it reads.

Nothing heavy is imported before a command is known; `main` is behind `vision-s2r` and every file of scripts/.
"""
