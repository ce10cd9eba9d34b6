"""Measured machines: what the diagnosis makes of real logs, and its errors on others that no fit has seen.

A folder of logs in (recordings, SAGE's motions, BAM's benches), tables for the docs out.
"""
