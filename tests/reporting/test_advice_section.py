"""The section of a report on what is in the record: made from what is stored, and from nothing else."""

from __future__ import annotations

import numpy as np

import sysid
from sysid.advice.finding import Finding, Topic, Verdict
from sysid.reporting.advice.record import AdviceRecord
from sysid.reporting.advice.words import said
from sysid.reporting.figures.advice_figure import advice_figure
from sysid.reporting.parts import Picture
from sysid.reporting.sections.advice import advice_section
from sysid.reporting.tables import Table
from sysid.workbench.runner.store import strict


def record(u: np.ndarray, y: np.ndarray) -> AdviceRecord:
    traces = sysid.data({"valve <1>": u, "level": y}, inputs="valve <1>", outputs="level", sample_time=0.1)
    stored = strict(sysid.advise(traces).to_dict())
    return AdviceRecord.model_validate_json(AdviceRecord.model_validate(stored).model_dump_json())


def test_every_finding_is_a_row_and_the_responses_are_drawn() -> None:
    u = np.repeat(np.random.default_rng(0).uniform(-1, 1, 60), 5)
    found = record(u, np.convolve(u, [0.0, 0.3, 0.2, 0.1])[:300])
    section = advice_section([found, found])
    tables = [part for part in section.parts if isinstance(part, Table)]
    assert [len(table.rows) for table in tables] == [len(found.findings) + len(found.suggestions)] * 2
    pictures = [part for part in section.parts if isinstance(part, Picture)]
    assert len(pictures) == 2
    assert "valve &lt;1&gt;" in pictures[0].svg


def test_responses_have_the_unit_of_a_ratio() -> None:
    u = np.repeat(np.random.default_rng(0).uniform(-1, 1, 60), 5)
    units = {"valve <1>": "l/min", "level": "cm"}
    found = record(u, np.convolve(u, [0.0, 0.3, 0.2, 0.1])[:300]).model_copy(update={"units": units})
    figure = advice_figure(found)
    assert figure is not None
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert labels == ["response [cm/(l/min)]", "gain [cm/(l/min)]", "coherence"]


def test_a_record_without_a_response_has_no_picture() -> None:
    section = advice_section([record(np.ones(20), np.arange(20.0))])
    assert not any(isinstance(part, Picture) for part in section.parts)


def test_a_finding_of_a_later_release_is_shown_by_its_code() -> None:
    found = record(np.ones(20), np.arange(20.0))
    later = found.findings[0].model_copy(update={"code": "weather.rain", "topic": "WEATHER", "verdict": "WET"})
    table = next(
        part
        for part in advice_section([found.model_copy(update={"findings": [later]})]).parts
        if isinstance(part, Table)
    )
    assert [cell.text for cell in table.rows[0]][:2] == ["WEATHER", "WET"]
    assert "weather.rain" in table.rows[0][2].text


def test_one_stands_alone_and_not_at_the_end_of_a_number() -> None:
    figures = {"seconds": 76.0, "length": 5.1}
    one = Finding(
        topic=Topic.DYNAMICS, code="settling.short_record", verdict=Verdict.LOOK, subject=("u",), figures=figures
    )
    assert "only 5.1 times that" in said(one, {"u": "1"})[0]


def test_powers_of_ten_are_written_as_people_read_them() -> None:
    """A sample time of an hour was 3.6e+03 s, and one of a nanosecond 1e-09 s."""
    for seconds, text in ((3600.0, "(3600 s)"), (1e-9, "(1\u00a0×\u00a010⁻⁹ s)"), (0.25, "(0.25 s)")):
        figures = {"best": 1.0, "seconds": seconds, "visible": 1.0}
        one = Finding(topic=Topic.DYNAMICS, code="dead_time", verdict=Verdict.FINE, subject=("u",), figures=figures)
        assert text in said(one, {"u": "1"})[0]
