"""YAML is read as plain values, and refused where it is damaged or means more than it says."""

from __future__ import annotations

from pathlib import Path

import pytest

from objstate.config import load_settings
from objstate.errors import SettingsError
from objstate.yaml_files import LONGEST, YamlError, read_yaml


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "a.yaml"
    path.write_text(text)
    return path


def test_plain_values_and_aliases_are_read(tmp_path: Path) -> None:
    path = written(tmp_path, "a: &one [1, 2.5, text]\nb: *one\nc: {<<: {d: 1}, e: ~}\n")
    values = [1, 2.5, "text"]
    assert read_yaml(path) == {"a": values, "b": values, "c": {"d": 1, "e": None}}
    assert read_yaml(written(tmp_path, "")) is None


BILLIONS = "a0: &a0 [1]\n" + "".join(
    f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]\n" for i in range(1, 10)
)
MERGED = "a0: &a0 {x: 1}\n" + "".join(
    f"a{i}: &a{i} {{<<: [{', '.join([f'*a{i - 1}'] * 10)}]}}\n" for i in range(1, 10)
)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[" * 3000, "nested too deeply"),
        ("a: {b: 1, c: 2, b: 3}", "'b' is given twice .line 1, column 17"),
        ("a: " + "9" * 5000, "can't be read"),
        ("a: 2021-13-45", "can't be read"),
        ("a: !!timestamp x", "can't be read"),
        ("a: !!bool x", "can't be read"),
        ("a: &a [*a]", "holds itself"),
        ("a: {b", "line 1"),
        ("a: \x00", "special characters"),
        ("? [a, {b: c}]\n: d", "unhashable"),
        (BILLIONS, "too many values"),
        (MERGED, "too many values"),
        ("a: !!python/object:os.system x", "constructor"),
    ],
)
def test_what_cannot_be_used_is_told_in_one_line(text: str, said: str, tmp_path: Path) -> None:
    path = written(tmp_path, text)
    with pytest.raises(YamlError, match=said) as caught:
        read_yaml(path)
    assert "\n" not in str(caught.value)
    with pytest.raises(SettingsError, match=r"a\.yaml is not valid YAML"):
        load_settings(path)


def test_a_file_that_is_far_too_long_is_not_read_to_its_end(tmp_path: Path) -> None:
    with pytest.raises(YamlError, match="longer than"):
        read_yaml(written(tmp_path, "# " + "x" * LONGEST))
