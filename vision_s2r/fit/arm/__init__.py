"""The diagnosis of arms: a log of all joints in, a problem of each joint out; and the whole arm's free run.

`problems.problems` makes of an arm one recording of kind joint for each of its joints: the load that the measured
motion of the others puts on it, and its own inertia over time, are inputs. `fit.joint` takes it from there. `whole`
fits a payload or a tilted base over all joints together, `free_run` is the whole arm's. Effects are named
`JOINT.EFFECT` here; those of the whole arm by themselves.
"""
