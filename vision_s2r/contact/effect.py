"""What a contact effect is: a wrong nominal coefficient, or something of body and support that the simulator lacks."""

from vision_s2r.effects import Effect, Registry


class ContactEffect(Effect):
    """An effect of a body on its support.

    To add one: a class in a file of `vision_s2r/contact/effects`, decorated with `CONTACT_EFFECTS.register`, its
    formula compiled beside it, and the place in `contact/impulses.py` or `contact/motion.py` where that formula acts.

    Bounds reach from a grain of rice to a crate, in SI units; `moderate` is meant for a cube of 10 cm and 0.4 kg.
    """


CONTACT_EFFECTS: Registry[ContactEffect] = Registry("contact")
