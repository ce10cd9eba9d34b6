"""What each term of a translator's loss is worth: arms that leave terms out, trained alike, tried on the same scenes.

In: rendered views, arms as overrides of the loss's weights (configs/ablation). Out: ablation.csv, ablation.json and
ablation.png, the change of grasp success and of every image metric against everything together; strip.png, what each
arm makes of the same scenes.
"""
