"""The transfer table: how well each way from picture to grasp survives a camera it was not trained for.

In: a folder of rendered test scenes and checkpoints of policies and translators. Out: table.csv, table.json and
index.html, a page that shows the numbers and what they look like.
"""
