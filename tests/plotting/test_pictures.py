"""Every picture is, in all its lines, marks, labels and limits, what was seen and found good."""
import json

from tests.plotting import pictures


def test_pictures_are_what_was_seen():
    known = json.loads(pictures.KNOWN.read_text(encoding="utf-8"))
    differs = pictures.same(json.loads(json.dumps(pictures.pictures())), known["pictures"])
    assert not differs, "\n".join([*differs[:20], "meant so? python -m tests.plotting.pictures writes anew; look at them first"])


def test_words_and_colours_are_what_was_seen():
    known = json.loads(pictures.KNOWN.read_text(encoding="utf-8"))
    assert not pictures.same(json.loads(json.dumps(pictures.words())), known["words"])
