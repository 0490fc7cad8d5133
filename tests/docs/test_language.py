"""What users read stays in plain words: private expressions, long sentences and history may become fewer, not more.

If it fails: `python docs/language.py NAME` shows the sentences of a file, `python docs/language.py` writes the counts.
"""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "docs"))

import language


@pytest.fixture(scope="module")
def counts():
    """Of all texts by name: the count now, and the text."""
    return {name: (language.count(text), text) for name, text in language.texts().items()}


def test_no_more_private_words_history_and_long_sentences(counts):
    """Pages without counts begin with none."""
    kept, wrong = language.read_counts(), {}
    for name, (now, text) in counts.items():
        private, history, long = kept.get(name, (0, 0, 0))
        if now.private > private:
            wrong[name] = sorted(set(language.found(text)))
        if now.history > history:
            wrong[f"{name}, history"] = now.history
        if now.long > long:
            every = language.sentences(language.running(text))
            wrong[f"{name}, long"] = [one for one in every if language.length(one) > language.LONG]
    assert not wrong


def test_few_sentences_of_documents_are_long(counts):
    """At most 2 % of the sentences in running text; messages and help have none to spare, either."""
    counts = [count for count, _ in counts.values()]
    assert sum(count.long for count in counts) <= 0.02 * sum(count.sentences for count in counts)


@pytest.mark.parametrize(
    ("text", "private"),
    [("The motor gives 3 N·m.", 1), ("given values", 0), ("two rows act on the tip", 1), ("a row of the table", 0),
     ("It was told, then reported.", 2), ("what hangs on the joint, held there", 2), ("the largest moment", 1),
     ("bending moments in the section", 0)],
)  # fmt: skip
def test_words_with_a_right_use_count_in_their_private_sense(text, private):
    assert language.count(language.prose(text)).private == private


def test_words_are_found_in_prose_alone():
    code = "    is told in code\n\n```\nis told\n```\n"
    text = f"A spring\nis told.\n\n{code}The key `is told` and [links](is told.md) stay.\n\n* It no longer is.\n"
    count = language.count(language.prose(text))
    assert (count.private, count.history, count.sentences) == (1, 1, 3)


@pytest.mark.parametrize(("words", "long"), [(35, 0), (36, 1)])
def test_a_sentence_of_more_than_35_words_is_long(words, long):
    assert language.count(language.prose("One. " + "word " * (words - 1) + "end.")).long == long
