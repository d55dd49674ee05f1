"""What `twin cite` lists: BibTeX and CFF that other programs read, and no work that a result does not rest on."""

from __future__ import annotations

import json
from pathlib import Path

import bibtexparser
import pytest
import yaml

from recordings import RunWriter
from twin.cli import main
from twin.commands.cite import as_bibtex, as_cff, references

ROOT = Path(__file__).parents[3]


def cited(capsys, *arguments: str | Path) -> list[str]:
    with pytest.raises(SystemExit) as ended:
        main(["cite", *map(str, arguments), "--json"])
    assert ended.value.code == 0
    return [work["key"] for work in json.loads(capsys.readouterr().out)["references"]]


def test_another_program_reads_every_entry_of_the_bibtex():
    library = bibtexparser.parse_string(as_bibtex(references()))
    assert library.failed_blocks == []
    assert [entry.key for entry in library.entries] == list(references())
    for entry in library.entries[1:]:
        assert {"author", "title", "year", "note"} <= set(entry.fields_dict)


def test_the_citation_file_at_the_top_is_that_of_this_version():
    """As GitHub and Zenodo read it; `twin cite --format cff > CITATION.cff` writes it."""
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert text == as_cff(references())
    read = yaml.safe_load(text)
    assert {"cff-version", "message", "title", "authors", "version", "license"} <= set(read)
    for work in read["references"]:
        assert {"type", "title", "authors", "year"} <= set(work)


def test_a_diagnosis_cites_its_method_and_the_law_of_its_rig_but_no_cause_that_it_excludes(tmp_path, capsys):
    answer = {"verdict": "none", "causes": [], "set_95": ["none"], "excluded": [{"cause": "joint-friction"}]}
    (tmp_path / "result.json").write_text(json.dumps(answer))
    (tmp_path / "extended.toml").write_text("[joint]\nlength = 0.05\n")
    found = cited(capsys, tmp_path)
    assert {"virtual-test-rig", "jalali2011", "desai1984", "rao1948", "kass1995"} <= set(found)
    assert "bussgang1952" not in found
    answer["causes"] = [{"cause": "joint-friction"}]
    (tmp_path / "result.json").write_text(json.dumps(answer))
    assert "bussgang1952" in cited(capsys, tmp_path)


def test_models_and_tables_cite_what_their_words_say(tmp_path, capsys):
    model = tmp_path / "model.toml"
    model.write_text('[[part]]\nkind = "matrices"\n')
    table = tmp_path / "modes.csv"
    table.write_text("mode,frequency_Hz,std_Hz\n1,26.5,0.1\n")
    assert cited(capsys, model) == ["virtual-test-rig", "craig1968"]
    assert cited(capsys, table) == ["virtual-test-rig", "guillaume2003"]
    assert cited(capsys, model, table) == ["virtual-test-rig", "craig1968", "guillaume2003"]


def test_a_recording_cites_by_the_rig_and_the_procedure_that_it_holds(tmp_path, capsys):
    path = tmp_path / "noise.mcap"
    attached = {"rig.toml": b"[joint]\nlength = 0.05\n", "procedure.toml": b'procedure = "random"\n'}
    with RunWriter(path, info={"source": "simulated"}, channels=[], attachments=attached):
        pass
    assert cited(capsys, path) == ["virtual-test-rig", "jalali2011", "desai1984", "welch1967"]


def test_a_folder_without_results_is_named(tmp_path, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["cite", str(tmp_path)])
    assert ended.value.code == 2
    assert "result.json" in capsys.readouterr().err
