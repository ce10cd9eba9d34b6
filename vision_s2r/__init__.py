"""Close, and diagnose, the gap between simulated and real robots that see."""
