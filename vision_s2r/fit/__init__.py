"""A recording as a likelihood: effects in, what they explain of it out. Both identify and diagnose build on it.

`case.Case` is what they see of a recording, whatever its kind; `gap` is how far the simulator is from it. `joint`,
`camera` and `unpaired` are the cases. Nothing in here imports identify, diagnose, report or patch.

What fitting needs of an effect is one record in one file: a `JointFit` in `fit/joint/effects/NAME.py`, a `CameraFit`
in `fit/camera/effects/NAME.py`. The type of the record and the registry stand in `fit/KIND/effect.py`, which imports
nothing but `vision_s2r.effects`, so that the file of an effect may hold its physics and its records; `effects.Records`
keeps them. Another kind (contact, arm) does the same: a frozen record of whatever its case would otherwise look up by
name, `KIND_FITS = Records("KIND", "fitting")`, a file an effect that calls `KIND_FITS.register`, and its own line in
`tests/test_effects_complete.py`.
"""
