"""The second reader finds planted faults and calls no good program faulty; `certificate.planting` counts more."""

from __future__ import annotations

from certificate.planting import KINDS, run

PROGRAMS, FAULTS = 10, 40


def test_planted_faults_are_found_and_good_programs_are_not_called_faulty() -> None:
    score = run(PROGRAMS, FAULTS, seed=5)
    assert score.good == PROGRAMS
    assert score.alarms == 0, score.wrong[0][1].corrected.decode()
    assert sum(score.planted.values()) == FAULTS
    assert len(score.planted) >= len(KINDS) - 1
    assert score.found == score.planted, (score.wrong[0][0], score.wrong[0][2].decode())
    assert score.proved > 0.85 * score.motions
