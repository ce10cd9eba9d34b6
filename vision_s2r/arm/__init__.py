"""Arms: rigid bodies by MuJoCo, each joint's drive by the compiled simulator of `vision_s2r.joint`.

`model.load(path)` reads MJCF or URDF; `Bodies` gives what they ask of each joint: inertia, and the load that the motion
of all others puts on it. With these as inputs a joint is a problem of its own; `simulate` runs them side by side.
"""
