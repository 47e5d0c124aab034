"""YAML as text: what scalars stay, where they stand, and one-line errors for everything else."""

import pytest
import yaml

from multibody_sym.errors import InputError
from multibody_sym.text import yaml_tree
from multibody_sym.text.yaml_tree import DEEPEST, LARGEST_FILE, Place, read_bytes, read_text


def refusal(text: str | bytes) -> InputError:
    with pytest.raises(InputError) as caught:
        read_bytes(text, "file.yaml") if isinstance(text, bytes) else read_text(text, "file.yaml")
    error = caught.value
    assert error.where.file == "file.yaml"
    assert "\n" not in error.message
    assert error.excerpt is None or error.excerpt.count("\n") == 1
    assert str(error).replace("\n", "").isprintable()
    return error


@pytest.mark.parametrize(
    "scalar",
    ["1e3", "012", "on", "yes", "no", "null", "~", "true", "1:30", "0x1F", "1_000", "=", "<<", ".inf", "-.5", "a b",
     "6 kg", "2001-01-01", "atan2(y", "[x", "-", "1/s", "0o7", "+1", ".", "é"],
)
def test_scalars_stay_the_text_that_was_written(scalar):
    quoted = scalar.startswith(("[", "-")) and len(scalar) < 3
    written = f"'{scalar}'" if quoted else scalar
    assert read_text(f"a: {written}", "f").data == {"a": scalar}


def test_structure_agrees_with_pyyaml_where_everything_is_quoted():
    text = """
"a": {"b": ["1", "2", {"c": "3"}], 'd': 'it''s'}
"e":
  - "x"
  - "y": "z"
    "w": "\\u00e9\\n"
"f": |
  two
  lines
"g": >-
  folded
  text
"h": {}
"i": []
"""
    assert read_text(text, "f").data == yaml.safe_load(text)


def test_nothing_is_the_empty_text():
    assert read_text("a:\nb: ''\nc: {d: , e: ''}", "f").data == {"a": "", "b": "", "c": {"d": "", "e": ""}}


def test_keys_stay_in_the_order_of_the_file():
    assert list(read_text("z: 1\na: 2\nm: 3", "f").data) == ["z", "a", "m"]


def test_places_of_keys_and_values():
    text = "joints:\n  A: {axis: z, q: 'phi'}\ngravity: [0,\n  -g, 0]\nnote: |\n  text\nx: \"\\u0041\"\n"
    tree = read_text(text, "f")
    assert tree.keys[("joints", "A")] == Place(2, 3, 3, True)
    assert tree.values[("joints", "A")] == Place(2, 6)
    assert tree.values[("joints", "A", "axis")] == Place(2, 13, 13, True)
    assert tree.values[("joints", "A", "q")] == Place(2, 19, 20, True)
    assert tree.values[("gravity", "1")] == Place(4, 3, 3, True)
    assert tree.values[("note",)] == Place(5, 7, None, True)
    assert tree.values[("x",)] == Place(7, 4, None, True)


def test_a_byte_order_mark_is_skipped():
    assert read_bytes(b"\xef\xbb\xbfa: 1\r\nb: 2\r\n", "f").data == {"a": "1", "b": "2"}


@pytest.mark.parametrize(
    ("text", "line", "column", "part"),
    [
        ("", 1, 1, "the file is empty"),
        ("# comment\n", 1, 1, "the file is empty"),
        ("a: 1\nb: 2\na: 3", 3, 1, "the key 'a' stands here a second time; first in line 1"),
        ("x: {a: 1, b: 2, a: 3}", 1, 17, "a second time"),
        ("a: &x 1", 1, 4, "anchors (&name) and aliases (*name) are not allowed"),
        ("a: 1\nb: *x", 2, 4, "aliases"),
        ("a: !!python/object/apply:os.system [id]", 1, 4, "tags (!name) are not allowed"),
        ("a: !x y", 1, 4, "tags"),
        ("a: !!str 1", 1, 4, "tags"),
        ("a: 1\n---\nb: 2", 2, 1, "a second document starts here"),
        ("? [a]\n: 1", 1, 3, "a key must be a name"),
        (": 1", 1, 1, "':' has no place here"),
        ("'': 1", 1, 1, "a key must be a name on one line"),
        ('"a\\nb": 1', 1, 1, "a key must be a name on one line"),
        ("a: 1\n\tb: 2", 2, 1, "a tab has no place here"),
        ("a: @x", 1, 4, "text that starts with @ is quoted"),
        ("a: `x`", 1, 4, "text that starts with ` is quoted"),
        ("a: b: c", 1, 5, "a ':' has no place here"),
        ("a: 'x", 1, 6, "the quote that opens before is never closed"),
        ("a: [1, 2\nb: 3", 2, 2, "a ',' or ']' is missing"),
        ("a: {b: 1\nc", 2, 2, "a ',' or '}' is missing"),
        ("c: {between: [#, top]}\nd: 1", 1, 15, 'hides the rest of the line: quote the name, "b #"'),
        ("c: {between: [b #+1, top]}\nd: 1", 1, 17, "quote the name"),
        ("c: {x: '[ #1', y: [1, #first\n2}", 1, 23, "quote the name"),
        ("c: {x: '[ #1', y: [1, # first\n2}", 2, 2, "a ',' or ']' is missing"),
        ("a:\n  b: 1\n c: 2", 3, 2, "does the indent fit"),
        ("a: 1\nb\nc: 2", 3, 1, "neither 'key: value'"),
        ("a: 1\n- b", 2, 1, "'-' has no place here"),
        ('a: "\\q"', 1, 6, "unknown escape character"),
        ('a: "\\UFFFFFFFF"', 1, 7, "out of range"),
        ('a: "x\\u202ey"', 1, 4, "the character U+202E"),
        ('a: "\\ud800"', 1, 4, "the character U+D800"),
        ("%YAML 1." + "9" * 5000 + "\n--- a", 1, 9, "out of range"),
        ("a: x\ud800", 1, 5, "the character U+D800"),
        ("a: 1\nb: \u202ex", 2, 4, "the character U+202E"),
        ("a: \x07", 1, 4, "the character U+0007"),
        ("\n\n  a\u2028b: 1", 3, 4, "the character U+2028"),
        ("x: {f: reaction(C, fx)}", 1, 8, 'contains a comma is quoted: "reaction(C, fx)"'),
        ("x: [atan2(a, b), 0]", 1, 5, 'contains a comma is quoted: "atan2(a, b)"'),
        ("x: {f: 2*max(a, min(b, c)) - 1, g: 0}", 1, 8, 'is quoted: "2*max(a, min(b, c)) - 1"'),
        ("x: {f: max(a, b\n  )}", 1, 8, "the comma ends this value before its ( is closed"),
    ],
)
def test_refusals(text, line, column, part):
    error = refusal(text)
    assert (error.where.line, error.where.column, part in error.message) == (line, column, True), str(error)


@pytest.mark.parametrize(
    ("content", "line", "column", "part"),
    [
        ("a: 1".encode("utf-16"), 1, 1, "UTF-16"),
        ("a: 1".encode("utf-16-be"), 1, 1, "UTF-16"),
        ("a: 1".encode("utf-32"), 1, 1, "UTF-16"),
        (b"a: 1\nb: \xfc", 2, 4, "the byte 0xFC is not valid UTF-8"),
        (b"a: 1\r\nb: caf\xc3", 2, 7, "the byte 0xC3"),
        (b"\xff", 1, 1, "0xFF"),
        (b"a: 1\n" + b"#" * LARGEST_FILE, 1, 1, "at most"),
    ],
)
def test_refused_bytes(content, line, column, part):
    error = refusal(content)
    assert (error.where.line, error.where.column, part in error.message) == (line, column, True), str(error)


@pytest.mark.parametrize("opening", ["[", "{a: ", "- ", "? "])
def test_nesting_is_limited(opening):
    assert f"more than {DEEPEST} deep" in refusal(opening * 100_000).message or opening == "? "


def test_the_number_of_nodes_is_limited(monkeypatch):
    monkeypatch.setattr(yaml_tree, "MOST_NODES", 1000)
    assert read_text("a: [" + "x," * 900 + "]", "f").data == {"a": ["x"] * 900}
    assert "at most 1000 keys and values" in refusal("a: [" + "x," * 1000 + "]").message
