from imop.baselines.words import LENGTH, numbers_of


def test_words_count_in_their_order_and_not_their_case():
    one, same, other = map(
        numbers_of, ("Push the red button", "push, the RED button.", "red the push button")
    )
    assert (one == same).all() and sorted(one) == sorted(other) and (one != other).any()


def test_what_is_missing_is_nothing_and_what_is_too_long_is_cut():
    assert not numbers_of("").any() and numbers_of("push")[1:].max() == 0
    assert len(numbers_of("a " * 100)) == LENGTH and numbers_of("a " * 100).all()
