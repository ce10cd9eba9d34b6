"""Bodies side by side in one register: that it is one, and that none sees its neighbours."""

import math

import numba
import numpy as np
import pytest
from llvmlite import binding

from vision_s2r.contact import NominalContact, benchmark, box, cylinder, pack, simulate, sphere
from vision_s2r.contact.lanes import LANES, any_of, bits, everywhere, in_lanes, where, zeros

DT = 1 / 148
EFFECTS = (
    {},
    {"rolling_friction": {"value": 0.004}, "spinning_friction": {"value": 0.002}},
    {"contact_compliance": {"stiffness": 2e4, "damping": 10.0}},
    {"corner_radius": {"value": 0.006}, "center_of_mass": {"x": 0.005, "y": 0.0, "z": -0.01}},
    {"support_tilt": {"roll": 0.05, "pitch": -0.02}, "restitution": {"value": 0.6}},
)


@numba.njit(error_model="numpy")
def reckoned(numbers):
    x = in_lanes(numbers)
    larger = x[0] > x[1]
    a, b = where(larger, (x[0], 2), (1.0, max(x[1], 3 - x[0])))
    total = 0.0
    for _ in range(3):
        total += abs(a) * math.sqrt(b)
    x[2] = -min(total, 100.0) / 4
    x[3] = where(larger & ~(x[0] >= 5) | everywhere(False), 1.0, 0.0)
    return any_of(larger), bits(larger)


def test_lanes_reckon_as_numbers_do_each_alone_and_by_packed_instructions():
    numbers = zeros(4)
    assert numbers.shape == (4, LANES) and numbers.ctypes.data % (8 * LANES) == 0
    numbers[0], numbers[1] = np.arange(LANES), np.arange(LANES)[::-1] - 1
    larger = numbers[0] > numbers[1]
    a, b = np.where(larger, numbers[0], 1), np.where(larger, 2, np.maximum(numbers[1], 3 - numbers[0]))
    assert reckoned(numbers) == (True, sum(1 << k for k in np.flatnonzero(larger)))
    assert numbers[2] == pytest.approx(-np.minimum(3 * np.abs(a) * np.sqrt(b), 100) / 4, rel=1e-15)
    assert np.array_equal(numbers[3], larger & (numbers[0] < 5))
    if binding.get_host_cpu_features().get("avx"):
        assembly = reckoned.inspect_asm(reckoned.signatures[0])
        assert "vsqrtpd" in assembly and "vsqrtsd" not in assembly and "vdivsd" not in assembly


@pytest.mark.parametrize("shape", [box((0.0524,) * 3), box((0.06, 0.04, 0.03)), sphere(0.05), cylinder(0.04, 0.08)])
def test_a_motion_is_the_same_bits_whatever_its_neighbours_are(shape):
    nominal = NominalContact(0.37, 0.2, 0.3)
    machines, first = np.stack([pack(nominal, each) for each in EFFECTS]), benchmark.toss(7, 3)
    first[0, 10:] *= 40  # so fast that series do not do
    first[1, [4, 8]] = -0.0
    together = simulate(machines, shape, first, 100, DT)
    assert np.isfinite(together).all()
    turned = simulate(machines[::-1], shape, first[::-1], 100, DT, threads=2)[::-1, ::-1]
    assert turned.tobytes() == together.tobytes()
    for c, w in ((0, 0), (2, 1), (4, 6)):
        alone = simulate(machines[c : c + 1], shape, first[w : w + 1], 100, DT)
        assert alone.tobytes() == together[c : c + 1, w : w + 1].tobytes()
