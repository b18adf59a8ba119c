import numpy as np
import pytest
from tests.approval import approve

from bridgegen.assess.conflict.findings import Findings
from bridgegen.assess.conflict.types import RULES, ConflictType
from bridgegen.search.triage.modes import (
    Key,
    by_frequency,
    clusters,
    group,
    keys_of,
    rekeyed,
    title,
)

CAR = Key("contact", "front-to-rear striking", "ego", "car", "", "planning")


def test_rows_that_agree_in_all_keys_are_one_mode_the_worst_first():
    random = np.random.default_rng(0)
    U, harm = random.random((60, 3)), random.uniform(0.3, 1.0, 60)
    keys = [CAR if k % 3 else CAR._replace(partner="truck") for k in range(60)]
    first, second = group(keys, harm, U)
    assert len(first.rows) + len(second.rows) == 60
    assert harm[first.rows[0]] == harm.max()
    for one in (first, second):
        assert {keys[i] for i in one.rows} == {one.key}
        assert (np.diff(harm[one.rows]) <= 0.0).all()


@pytest.mark.parametrize("seed", range(5))
def test_modes_do_not_depend_on_the_order_of_rows(seed):
    random = np.random.default_rng(seed)
    U = np.concatenate([random.normal(0.2, 0.02, (40, 4)), random.normal(0.8, 0.02, (30, 4))])
    harm = np.round(random.uniform(0.3, 1.0, 70), 1)  # many are equal
    keys = [CAR if random.random() < 0.7 else CAR._replace(place="x") for _ in range(70)]
    before = group(keys, harm, U)
    order = random.permutation(70)
    after = group([keys[i] for i in order], harm[order], U[order])
    assert [one.key for one in before] == [one.key for one in after]
    for one, other in zip(before, after, strict=True):
        assert one.rows.tolist() == order[other.rows].tolist()
    assert len(before) == 4  # two keys, two clusters each


def test_only_clusters_that_are_clearly_apart_are_told_apart():
    random = np.random.default_rng(0)
    cloud = random.random((200, 3))
    assert set(clusters(cloud)) == {0}
    near = np.concatenate([random.normal(0.45, 0.03, (50, 3)), random.normal(0.6, 0.03, (50, 3))])
    assert set(clusters(near)) == {0}
    far = np.concatenate([random.normal(0.2, 0.03, (50, 3)), random.normal(0.8, 0.03, (50, 3))])
    assert clusters(far).tolist() == [0] * 50 + [1] * 50
    # A few rows astray are no mode of their own: they join the nearest.
    astray = np.concatenate([far, np.full((2, 3), 0.5)])
    assert set(clusters(astray)) == {0, 1}


def test_few_rows_or_no_parameters_are_one_cluster():
    assert clusters(np.array([[0.0], [1.0]])).tolist() == [0, 0]
    assert clusters(np.empty((20, 0))).tolist() == [0] * 20
    assert clusters(np.empty((0, 3))).tolist() == []


def test_modes_whose_tested_cause_is_the_same_are_one():
    random = np.random.default_rng(0)
    U, harm = random.random((40, 3)), random.uniform(0.3, 1.0, 40)
    keys = [CAR if k % 2 else CAR._replace(cause="control") for k in range(40)]
    groups = group(keys, harm, U)
    (joined,) = rekeyed(groups, [CAR, CAR], harm, U)
    assert sorted(joined.rows) == list(range(40))
    assert (np.diff(harm[joined.rows]) <= 0.0).all()
    assert len(rekeyed(groups, [one.key for one in groups], harm, U)) == 2


def test_titles_are_in_words():
    approve(title(CAR, ["rear distance"]))
    near = CAR._replace(conflict="near miss", partner="pedestrian", place="in the junction",
                        conflict_type=ConflictType.VRU_BY_FRONT.label,
                        responsible="other")  # fmt: skip
    approve(title(near, ["stepped out"]), "responsible")
    for kind in ConflictType:
        for rule in RULES:
            for conflict in ("contact", "near miss"):
                key = Key(conflict, kind.label, "shared", "animal", "", "")
                assert "{" not in title(key, [rule.label])


def test_a_title_names_the_emergency_vehicle_to_which_the_ego_did_not_give_way():
    key = Key("contact", "crossing", "ego", "car", "in the junction")
    rules = ["emergency vehicle"]
    approve(title(key, rules))
    approve(title(key._replace(responsible="other"), rules), "crosses")


def test_a_title_names_all_rules_that_occur_the_most_frequent_first():
    rules = by_frequency(["junction occupied", "right before left", "right before left"])
    assert rules == (("right before left", 2), ("junction occupied", 1))
    key = Key("contact", "crossing", "ego", "car", "in the junction")
    text = title(key, [one for one, _ in rules])
    approve(text, "responsible")
    assert text.count("; or ") == 1
    assert text.index("from the right") < text.index("; or drove on")


def test_the_rule_s_name_alone_makes_no_other_mode():
    findings = Findings.none(2)
    findings.rule[:] = ["junction occupied", "right before left"]
    one, other = keys_of(findings, {}, ["", ""], ["", ""])
    assert one == other
