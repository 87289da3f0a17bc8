"""The page as a reader and a machine see it."""

from __future__ import annotations

import html.parser
import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from sysid.errors import ConfigError
from sysid.reporting import read_results, write_report
from sysid.reporting.figures import fit_figures as figures
from sysid.reporting.html import page_template
from sysid.validation.metrics import MERITS

PAIR = ("ARX", "NARX free run")
VOID = {"meta", "link", "br", "img", "input", "hr", "use", "path", "rect"}


class Page(html.parser.HTMLParser):
    """Checks nesting and collects what the tests ask for."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []
        self.references: list[str] = []
        self.headings: list[str] = []
        self.attributes: list[tuple[str, dict[str, str | None]]] = []
        self.tables: list[dict[str, Any]] = []
        self.texts: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        fields = dict(attrs)
        self.attributes.append((tag, fields))
        if tag not in VOID:
            self.open.append(tag)
        if fields.get("id"):
            self.ids.append(str(fields["id"]))
        for name in ("href", "src", "srcset", "action", "data", "poster"):
            if fields.get(name):
                self.links.append(str(fields[name]))
        self.references += str(fields.get("aria-labelledby") or "").split()
        if tag in {"h1", "h2", "h3", "h4"}:
            self.headings.append(tag)
        if tag == "table":
            self.tables.append({"caption": "", "rows": []})
        elif tag == "tr":
            self.tables[-1]["rows"].append([])
        elif tag in {"td", "th"}:
            self.tables[-1]["rows"][-1].append({"tag": tag, "text": "", "scope": fields.get("scope"), "value": None})
        elif tag == "data":
            self.tables[-1]["rows"][-1][-1]["value"] = float(str(fields["value"]))

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        if tag in VOID:
            return
        assert self.open.pop() == tag, f"</{tag}> closes something else, line {self.getpos()[0]}"

    def handle_data(self, data: str) -> None:
        self.texts.append(data)
        if "caption" in self.open and self.tables:
            self.tables[-1]["caption"] += data
        elif {"td", "th"} & set(self.open):
            self.tables[-1]["rows"][-1][-1]["text"] += data

    def table(self, words: str) -> list[list[dict[str, Any]]]:
        (found,) = [table for table in self.tables if table["caption"].startswith(words)]
        return found["rows"]


def row_named(rows: list[list[dict[str, Any]]], name: str) -> list[dict[str, Any]]:
    (found,) = [row for row in rows if row[0]["text"] == name or row[0]["text"].startswith(f"{name}NARX 4/4/20,")]
    return found


@pytest.fixture(scope="module")
def path(run_folder: Path) -> Path:
    return write_report(run_folder)


@pytest.fixture(scope="module")
def page(path: Path) -> Page:
    return Page(path.read_text(encoding="utf-8"))


def test_the_page_is_where_the_contract_says(path: Path, run_folder: Path) -> None:
    assert path == run_folder / "report" / "index.html"
    assert sorted(file.name for file in path.parent.iterdir()) == ["index.html", "results.json"]


def test_every_element_is_closed_and_every_id_is_its_own(page: Page) -> None:
    assert page.open == []
    assert len(set(page.ids)) == len(page.ids)


def test_nothing_is_fetched_from_anywhere(page: Page, path: Path) -> None:
    outside = [link for link in page.links if not link.startswith("#") and link not in {"data:,", "results.json"}]
    assert outside == []
    text = path.read_text(encoding="utf-8")
    assert not re.search(r"https?://|@import|<script|url\((?!#)", text)


def test_links_within_the_page_lead_somewhere(page: Page) -> None:
    targets = {link[1:] for link in page.links if link.startswith("#")} | set(page.references)
    assert targets
    assert targets <= set(page.ids)


def test_a_screen_reader_finds_language_headings_captions_scopes_and_figure_texts(page: Page) -> None:
    assert next(fields for tag, fields in page.attributes if tag == "html")["lang"] == "en-GB"
    assert page.headings[0] == "h1"
    assert page.headings.count("h1") == 1
    assert set(page.headings) == {"h1", "h2"}
    assert all(table["caption"] for table in page.tables)
    headers = [cell for table in page.tables for row in table["rows"] for cell in row if cell["tag"] == "th"]
    assert {cell["scope"] for cell in headers} == {"row", "col"}
    drawings = [fields for tag, fields in page.attributes if tag == "svg"]
    # A picture for every fit and case, and those of the run as a whole.
    assert len(drawings) == sum(tag == "figure" for tag, _ in page.attributes) >= 20 + 5
    assert all(fields["role"] == "img" and fields["aria-labelledby"] for fields in drawings)


def test_the_verdict_stands_before_everything_else(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert 0 < text.index('id="verdict"') < text.index("<nav") < text.index("<table")
    assert (
        "Best model of pump+valve → level: NARX free run (NARX 4/4/20, trained in closed loop, 281 parameters)." in text
    )


@pytest.mark.parametrize(("kind", "words"), [("free_run", "Free run"), ("one_step", "One step ahead")])
def test_every_error_in_the_table_is_the_one_in_results_json(
    page: Page, run_folder: Path, kind: str, words: str
) -> None:
    rows = page.table(f"{words}: mean squared error [psi²]")
    cases = [cell["text"] for cell in rows[0][1:-1]]
    assert cases == ["EST01estimation", "VAL01validation", "VAL02validation", "VAL03validation", "VAL04test"]
    stored = json.loads((run_folder / "results.json").read_text())
    for fit, row in zip(stored["fits"], rows[1:], strict=True):
        assert row[0]["text"].startswith(fit["name"])
        for case, cell in zip(fit["cases"].values(), row[1:-1], strict=True):
            mse = case[kind]["mse"]
            if mse is None:
                assert (cell["text"], math.isnan(cell["value"])) == ("diverged", True)
            else:
                assert cell["value"] == mse
                assert _read(cell["text"]) == pytest.approx(mse, rel=5e-3)


def _read(text: str) -> float:
    """A printed number back as a number."""
    plain = text.translate(str.maketrans("−⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "--0123456789")).replace("\u202f", "")
    mantissa, _, power = plain.partition("\u00a0×\u00a010")
    return float(mantissa) * 10.0 ** int(power or 0)


@pytest.mark.parametrize("kind", ["free_run", "one_step"])
def test_every_figure_of_the_chosen_fit_is_the_one_in_results_json(page: Page, run_folder: Path, kind: str) -> None:
    best = read_results(run_folder).best_fit
    assert best is not None
    rows = page.table(f"{best.name}, {kind.replace('_', ' ')}")
    for row in rows[1:]:
        case = getattr(best.cases[row[0]["text"]], kind)
        assert [cell["value"] for cell in row[2:]] == [getattr(case, merit.key) for merit in MERITS]


def test_the_first_picture_has_every_model_over_the_measured_output_case_by_case(page: Page, run_folder: Path) -> None:
    text = (run_folder / "report" / "index.html").read_text(encoding="utf-8")
    section = text[text.index('<section id="overview"') : text.index('<section id="accuracy"')]
    results = read_results(run_folder)
    assert section.count("<svg") == len(results.fits[0].cases)
    for index, fit in enumerate(results.fits):
        assert f'id="overview-0-model-{index}" checked> ' in section
        assert section.count(f'class="model-{index}"') == len(fit.cases)
        assert f"#overview-0:has(#overview-0-model-{index}:not(:checked)) .model-{index}" in text
    radios = re.findall(r'id="overview-0-case-\d+"( checked)?> (\w+)', section)
    assert radios[0] == (" checked", "VAL01"), "what nothing was fitted to comes first"
    assert "<script" not in text


@pytest.mark.usefixtures("undrawn")
def test_a_model_without_a_run_one_step_ahead_claims_no_figures_of_it(
    make_run: Callable[..., Path], tmp_path: Path
) -> None:
    def output_error(document: dict[str, Any]) -> None:
        for case in document["fits"][0]["cases"].values():
            case |= {
                "predicts": False,
                "one_step": {"mse": None, "nrmse_fit": None, "max_abs_error": None, "unit": "psi"},
            }

    folder = make_run(tmp_path / "run", samples=100, names=("ARX", "NARX free run"), edit=output_error)
    assert [fit.predicts for fit in read_results(folder).fits] == [False, True]
    tables = Page(write_report(folder).read_text(encoding="utf-8"))
    (arx,) = [row for row in tables.table("One step ahead") if row[0]["text"].startswith("ARX")]
    assert {cell["text"] for cell in arx[1:]} == {"-"}
    assert not [table for table in tables.tables if table["caption"].startswith("ARX, one step ahead")]


def test_run_times_are_those_of_results_json_in_milliseconds(page: Page, run_folder: Path) -> None:
    rows = page.table("Run time of the free run [ms]")
    for fit, row in zip(read_results(run_folder).fits, rows[1:], strict=True):
        assert [cell["value"] for cell in row[1:]] == [1e3 * case.run_time_s for case in fit.cases.values()]


def test_fits_are_ranked_by_the_traces_that_choose(page: Page) -> None:
    rows = page.table("Every fit of this run")
    names = [row[0]["text"] for row in rows[1:]]
    assert names == ["NARX free runchosen", "NARX free run, small", "ARX", "NARX one step"]


def test_what_the_run_says_in_words_is_on_the_page_and_escaped(page: Page, path: Path) -> None:
    words = "".join(page.texts)
    for text in (
        "The free run is <stable>.",
        "The iterations ran out while the loss was still improving; allow more of them.",
        "Recorded on the rig. Averaged to 0.1 s.",
        "Least mean free-run mse on the selection traces SEL01 and SEL02.",
        "sysid run tank-level --seed 3",
        "NARX one step: the free run diverges on VAL03.",
        "numpy 2.2.1",
        "bundle/step.onnx",
        "within tolerance",
    ):
        assert text in words
    assert "<stable>" not in path.read_text(encoding="utf-8")


def test_a_template_is_translated_once_a_process() -> None:
    assert page_template("report.html.j2") is page_template("report.html.j2")


def test_a_report_made_twice_is_the_same_to_the_byte(make_run: Callable[..., Path], tmp_path: Path) -> None:
    """With every kind of picture, each of one case."""
    folder = make_run(tmp_path / "run", edit=lambda document: document.update(drawn=1))
    before = write_report(folder).read_bytes()
    write_report(folder)
    assert (folder / "report" / "index.html").read_bytes() == before


@pytest.mark.slow
def test_four_fits_on_five_cases_of_20000_noisy_samples_stay_under_three_megabytes(
    make_run: Callable[..., Path], tmp_path: Path
) -> None:
    page = write_report(make_run(tmp_path / "large", samples=20_000))
    assert page.stat().st_size < 3_000_000


@pytest.mark.usefixtures("undrawn")
def test_published_figures_stand_beside_ours_with_their_ratio(
    make_run: Callable[..., Path], workspace: Path, tmp_path: Path
) -> None:
    folder = make_run(tmp_path / "run", names=PAIR, edit=lambda document: document.update(published="tanks"))
    page = Page(write_report(folder, workspace=workspace).read_text(encoding="utf-8"))
    rows = page.table("Free run: mean squared error")
    assert rows[-1][0]["text"] == "publishedTable 1: NARX 4/4/20, best"
    assert [cell["value"] for cell in rows[-1][1:4]] == [None, 0.0020, 0.0020]
    assert page.table("One step ahead")[-1][2]["value"] == 0.00010
    assert page.table("Run time")[-1][2]["value"] == pytest.approx(200.0)
    beside = read_results(folder / "report").fits[1].cases["VAL01"]
    assert beside.published is not None
    assert beside.published["free_run"].ratio == beside.free_run.mse / 0.0020
    assert beside.published["one_step"].ratio == beside.one_step.mse / 0.00010
    assert read_results(folder).fits[1].cases["VAL01"].published is None
    assert "Other tanks." in "".join(page.texts)


@pytest.mark.usefixtures("undrawn")
def test_figures_of_another_unit_are_not_set_beside_ours(
    make_run: Callable[..., Path], workspace: Path, tmp_path: Path
) -> None:
    def in_kilopascal(document: dict[str, Any]) -> None:
        document["published"] = "tanks"
        for fit in document["fits"]:
            for case in fit["cases"].values():
                case["free_run"]["unit"] = case["one_step"]["unit"] = "kPa"

    folder = make_run(tmp_path / "run", samples=300, names=PAIR, edit=in_kilopascal)
    write_report(folder, workspace=workspace)
    published = read_results(folder / "report").fits[0].cases["VAL01"].published
    assert published is not None
    assert set(published) == {"run_time"}


def _no_best(document: dict[str, Any]) -> None:
    document["best"] = None


def _only_estimation(document: dict[str, Any]) -> None:
    for fit in document["fits"]:
        fit["cases"] = {name: case for name, case in fit["cases"].items() if case["role"] == "estimation"}


def _seen_again(document: dict[str, Any]) -> None:
    for fit in document["fits"]:
        seen = next(case for case in fit["cases"].values() if case["role"] == "estimation")
        unseen = next(case for case in fit["cases"].values() if case["role"] == "validation")
        unseen["free_run"], unseen["n_samples"] = dict(seen["free_run"]), seen["n_samples"]


def _all_diverge(document: dict[str, Any]) -> None:
    for fit in document["fits"]:
        for case in fit["cases"].values():
            case["free_run"].update(mse=None, nrmse_fit=None, max_abs_error=None, r=None)


def _bad_export(document: dict[str, Any]) -> None:
    document["fits"][1]["exports"][0]["largest_difference"] = None


def _least(document: dict[str, Any]) -> None:
    document["fits"] = [document["fits"][0]]
    document["best"] = document["selection"] = None
    for key in ("notes", "evidence", "n_parameters", "selection_mse", "exports", "learning_curve"):
        del document["fits"][0][key]


def _worse_is_chosen(document: dict[str, Any]) -> None:
    document["best"]["name"] = "ARX"


def _two_mappings(document: dict[str, Any]) -> None:
    document["fits"][0]["mapping"] = "pump -> flow"


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize(
    ("edit", "words"),
    [
        pytest.param(_no_best, "No fit was chosen.", id="no-fit-was-chosen"),
        pytest.param(_only_estimation, "There is no validation or test case", id="no-validation-case"),
        pytest.param(_seen_again, "it is the same record, and tests nothing", id="a-record-is-seen-again"),
        pytest.param(_all_diverge, "The free run diverges on every one of the 4 cases", id="everything-diverges"),
        pytest.param(_bad_export, "bundle/step.onnx differs from its model by more than", id="export-not-finite"),
        pytest.param(
            _worse_is_chosen, "NARX free run has a lower mean free-run mse on the unseen", id="another-is-better"
        ),
        pytest.param(_least, "none was marked as the best", id="only-the-required-keys"),
        pytest.param(_least, "Every fit of this run, in the order of the pipeline.", id="nothing-that-chooses"),
        pytest.param(_two_mappings, "by case. pump → flow.", id="two-mappings"),
    ],
)
def test_a_run_that_is_not_as_hoped_is_reported_in_words(
    make_run: Callable[..., Path], tmp_path: Path, edit: Callable[[dict[str, Any]], None], words: str
) -> None:
    page = Page(
        write_report(make_run(tmp_path / "run", samples=300, names=PAIR, edit=edit)).read_text(encoding="utf-8")
    )
    assert page.open == []
    assert words in "".join(page.texts)
    printed = " ".join(page.texts)
    assert not re.search(r"\b(nan|inf|None)\b", printed)


@pytest.mark.usefixtures("undrawn")
def test_the_regressions_of_a_fit_are_those_of_the_cases_that_are_drawn(
    make_run: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each is a panel of its own: of 90 cases they took longest of all."""
    panels, draw = list[list[str]](), figures.regression_figure
    monkeypatch.setattr(
        figures, "regression_figure", lambda signals, *a, **k: panels.append([*signals]) or draw(signals, *a, **k)
    )
    folder = make_run(tmp_path / "run", samples=50, names=PAIR, edit=lambda document: document.update(drawn=1))
    write_report(folder)
    assert [len(names) for names in panels] == [1]


def test_signals_that_are_missing_are_named(make_run: Callable[..., Path], tmp_path: Path) -> None:
    folder = make_run(tmp_path / "run", samples=50, names=PAIR)
    (folder / "fits" / "arx" / "signals.npz").unlink()
    with pytest.raises(ConfigError, match=r"arx.signals\.npz"):
        write_report(folder)
    assert not (folder / "report").exists()


def test_an_unknown_table_of_published_figures_is_named_with_those_there_are(
    make_run: Callable[..., Path], workspace: Path, tmp_path: Path
) -> None:
    folder = make_run(tmp_path / "run", samples=50, names=PAIR, edit=lambda document: document.update(published="tank"))
    with pytest.raises(ConfigError, match="tanks"):
        write_report(folder, workspace=workspace)
