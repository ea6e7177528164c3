"""Threads: all together while that is faster, one alone while it is not."""

from softsim.solver.threads import MANY_TURNS, TURN, ThreadCount


def workers_of(threads, calls, alone, together):
    """Workers of each of so many calls, a turn each, at these paces [s an increment]."""
    found = []
    for _ in range(calls):
        found.append(threads.workers)
        threads.note(10_000, 10_000 * (alone if threads.workers == 1 else together))
    return found


def test_together_with_a_look_at_one_alone_now_and_then():
    found = workers_of(ThreadCount(2), 2 * MANY_TURNS + 3, alone=100e-6, together=55e-6)
    assert found == 2 * ([1] + MANY_TURNS * [2]) + [1]


def test_alone_while_together_is_slower_then_tried_again():
    threads = ThreadCount(4)
    found = workers_of(threads, MANY_TURNS + 3, alone=100e-6, together=500e-6)
    assert found == [1, 4] + MANY_TURNS * [1] + [4]
    found = workers_of(threads, MANY_TURNS + 3, alone=100e-6, together=30e-6)
    assert found == MANY_TURNS * [1] + [4, 4, 4]


def test_a_slow_moment_is_borne():
    threads = ThreadCount(2)
    workers_of(threads, 2, alone=100e-6, together=60e-6)
    assert workers_of(threads, 2, alone=100e-6, together=150e-6) == [2, 2]
    assert workers_of(threads, 4, alone=100e-6, together=60e-6) == [2, 2, 2, 2]
    assert workers_of(threads, 4, alone=100e-6, together=150e-6) == [2, 2, 2, 1]


def test_a_first_look_at_a_busy_moment_is_forgotten():
    threads = ThreadCount(2)
    workers_of(threads, 1, alone=5000e-6, together=0.0)
    found = workers_of(threads, MANY_TURNS + 3, alone=100e-6, together=400e-6)
    assert found == MANY_TURNS * [2] + [1, 2, 1]


def test_short_calls_add_up_to_a_turn():
    threads = ThreadCount(2)
    for _ in range(3):
        threads.note(1, 0.3 * TURN)
    assert threads.workers == 1
    threads.note(1, 0.3 * TURN)
    assert threads.workers == 2


def test_one_stays_one():
    assert set(workers_of(ThreadCount(1), 20, alone=1e-4, together=1e-4)) == {1}
