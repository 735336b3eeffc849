import pickle

from mrfit.errors import DataError
from mrfit.ingest.refusal import Refusal, excerpt


def test_message_holds_path_reason_and_remedy() -> None:
    refusal = Refusal("a.csv", "no rate", "write rate = HZ")
    assert str(refusal) == "a.csv: no rate; write rate = HZ"
    assert isinstance(refusal, DataError)


def test_text_of_a_damaged_file_stays_one_short_line() -> None:
    refusal = Refusal("a.csv", "unit '\n\x00" + "\u0085x" * 500 + "'", "export again")
    assert str(refusal).isprintable()
    assert len(str(refusal)) < 450


def test_survives_the_way_out_of_a_worker_process() -> None:
    again = pickle.loads(pickle.dumps(Refusal("a.csv", "no rate", "write rate = HZ")))
    assert (again.path, again.reason, again.remedy) == ("a.csv", "no rate", "write rate = HZ")


def test_excerpt_is_one_short_printable_line() -> None:
    shown = excerpt("\x00\x07time,\tcurrent" + "," * 100)
    assert len(shown) == 60
    assert shown.isprintable()
