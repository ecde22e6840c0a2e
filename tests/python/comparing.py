"""Comparison of runs bit for bit."""

import vibroimpact as vi

ARRAYS = ("impacts", "stroboscopic", "events", "grazes", "contacts")


def assert_same_bits(left: vi.Run, right: vi.Run) -> None:
    """Assert that two runs hold the same bits and ended alike."""
    for name in ARRAYS:
        assert getattr(left, name).dtype == getattr(right, name).dtype
        assert getattr(left, name).shape == getattr(right, name).shape
        assert getattr(left, name).tobytes() == getattr(right, name).tobytes(), name
    assert left.final_state == right.final_state
    assert left.impact_count == right.impact_count
    assert left.kept_from == right.kept_from
    assert left.time_in_contact == right.time_in_contact
    assert left.stop_reason == right.stop_reason
    assert left.stop_detail == right.stop_detail
