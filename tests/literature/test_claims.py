"""The paper's claims, each measured against the ledger's numbers."""

import pytest

from wheeltapper.faces.paper.run import CLAIMS, run


@pytest.mark.parametrize("number", sorted(CLAIMS))
def test_a_claim_holds(number):
    failed = [m for m in CLAIMS[number].measure() if not m.holds]
    assert not failed


def test_claims_are_said_one_by_one():
    said = []
    assert run(["C20"], said.append) == 0
    assert [line.split()[0] for line in said] == ["C20", "PASS", "PASS", "1"]
