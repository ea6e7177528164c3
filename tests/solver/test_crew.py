"""A crew: together while that is faster, one alone while it is not."""

from softsim.solver.crew import RETRY_AFTER, SHORTEST, Crew


def paces(crew, calls, alone, together):
    """Workers of each of so many calls whose paces [s an increment] are these."""
    workers = []
    for _ in range(calls):
        workers.append(crew.workers)
        crew.note(1000, 1000 * (alone if crew.workers == 1 else together))
    return workers


def test_together_after_one_look_at_one_alone():
    assert paces(Crew(2), 50, alone=100e-6, together=55e-6) == [1] + 49 * [2]


def test_alone_while_together_is_slower_then_tried_again():
    crew = Crew(4)
    found = paces(crew, RETRY_AFTER + 4, alone=100e-6, together=500e-6)
    assert found == [1, 4] + RETRY_AFTER * [1] + [4, 1]
    found = paces(crew, RETRY_AFTER + 4, alone=100e-6, together=30e-6)
    assert found[-4:] == [4, 4, 4, 4]


def test_short_calls_say_nothing():
    crew = Crew(2)
    crew.note(1, 0.5 * SHORTEST)
    assert crew.workers == 1


def test_one_stays_one():
    assert set(paces(Crew(1), 20, alone=1e-4, together=1e-4)) == {1}
