"""What each term of a translator's loss is worth: variants without them, trained alike, tried on the same scenes.

In: rendered views, variants as overrides of the loss's weights (configs/ablation). Out: ablation.csv, ablation.json and
ablation.png, the change of grasp success and of every image metric against everything together; strip.png, what each
variant makes of the same scenes.
"""
