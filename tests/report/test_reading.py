"""What a report says of its effects is read back, or refused in one line."""

import pytest
from reports import a_report

from vision_s2r.errors import UserError
from vision_s2r.report.reading import diagnosed


@pytest.mark.parametrize("interval", [3, [1.0], ["wide", 1.0], [0.0, 10**400]])
def test_an_interval_that_is_none(interval: object) -> None:
    report = a_report("joint", backlash={"width": 0.03})
    report["effects"][0]["parameters"]["width"]["ci"] = interval
    with pytest.raises(UserError, match=r"backlash: ci of width is .*expected \[low, high\]"):
        diagnosed(report)
