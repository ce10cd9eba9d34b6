"""Unpaired cameras: two sets of pictures with no scene in common, compared by their statistics.

In: a camera recording whose pairing is "unpaired". Out: `case.UnpairedCase`, which the diagnosis asks about it.
Statistics of each picture (tones, light over the picture, spectrum, noise by brightness, the 8 px grid) are held
against those of the simulator's set as a camera with effects would take it; scenes scatter both, which is the noise
here.
"""
