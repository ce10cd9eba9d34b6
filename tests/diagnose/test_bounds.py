"""How large an effect without a name could be."""

from typing import Any

import pytest
from recordings import an_arm

from tests.diagnose.stand_in import Curves, recording
from vision_s2r.diagnose.assess import Assessor
from vision_s2r.diagnose.config import DiagnoseConfig, SearchConfig
from vision_s2r.diagnose.diagnose import diagnose
from vision_s2r.diagnose.report import report
from vision_s2r.diagnose.search import Search
from vision_s2r.diagnose.settle import settle
from vision_s2r.errors import UserError
from vision_s2r.fit.case import Hypothesis, Names, Segments
from vision_s2r.report import words
from vision_s2r.report.gap_report import GapReport
from vision_s2r.report.page import html


class Far(Curves):
    """Its fits of a step end where they begin: its likelihood is rough."""

    def fit(self, names: Names, segments: Segments, start: Hypothesis | None) -> Hypothesis:
        found = super().fit(names - {"step"}, segments, start)
        if "step" not in names:
            return found
        begun = {"size": 5.0} if start is None else start.values.get("step", {"size": 5.0})
        return Hypothesis({**found.values, "step": begun}, found.extra)


def reported(case: Curves) -> dict[str, Any]:
    assessor = Assessor(case, SearchConfig(), jobs=2, seed=0)
    return report(case, assessor, settle(case, assessor, Search(case, assessor).run()), bounded=True)[0]


def bounded(case: Curves) -> dict[str, dict[str, Any]]:
    return {line["name"]: line for line in reported(case)["candidates"]}


def test_what_has_no_name_has_room_and_what_has_one_has_an_interval() -> None:
    lines = bounded(Curves(recording(4, wave=1.0, step=0.01), not_excited={"curve": "nothing shows it"}))
    low, high = lines["step"]["could_be"]["size"]["ci"]
    assert lines["step"]["status"] == "absent" and low < 0 < 0.01 < high < 0.15
    assert "could_be" not in lines["wave"] and "could_be" not in lines["curve"]


def test_a_size_that_the_recording_rules_out_is_no_room_for_it() -> None:
    low, high = bounded(Far(recording(4, wave=1.0)))["step"]["could_be"]["size"]["ci"]
    assert low <= 0 < high < 0.2


@pytest.mark.parametrize(
    ("ci", "said"),
    [((0.0, 0.002), "at most 0.002 rad"), ((5.0, None), "at least 5 rad"), ((-1.0, 2.0), "−1.0 to 2.0 rad")],
)
def test_room_in_words(ci: tuple[float | None, float | None], said: str) -> None:
    assert words.room({"unit": "rad", "ci": ci}) == said


def test_the_page_and_the_report_in_memory_have_it() -> None:
    found = reported(Curves(recording(4, wave=1.0)))
    line = next(each for each in GapReport.of(found).candidates if each.name == "step")
    assert line.could_be and line.could_be["size"].unit == "m"
    assert words.room({"unit": "m", "ci": line.could_be["size"].ci}) in html(found, {})


def test_an_arm_has_none_and_says_so() -> None:
    with pytest.raises(UserError, match="bounds: an arm's report has none"):
        diagnose(an_arm(), DiagnoseConfig(bounds=True))
