"""Closing the loop: a diagnosed camera becomes the one that a translator trains under, and the table says what it won.

In: recordings of cameras, or cameras that are drawn and withheld; a translator and a policy. Out: for each camera its
diagnosis, translators fine-tuned under it, and a transfer table on that camera.
"""
