"""What follows from the rule that decides what is critical."""

import bridgegen as bg

GIVEN = {"algorithm": "random", "budget": 60, "seed": 0, "keep": 2}


def test_by_harm_nobody_stops_dead_where_the_road_ends(tmp_path):
    """The paper's S3 has `road_end: stand`, which the paper's evaluation needs."""
    harm, paper, thresholds = (
        bg.run_search("paper/crossroads-s3", **GIVEN, **how, triage="none", out=tmp_path / name)
        for name, how in (
            ("a", {"objective": "harm"}),
            ("b", {}),
            ("c", {"objective": "harm", "critical": "thresholds"}),
        )
    )  # fmt: skip
    assert harm.frame()["implausible"].isna().all()
    stops = paper.frame()["implausible"] == "deceleration beyond the body's"
    assert stops.any()
    assert paper.frame()["critical"][stops].any()  # the paper's evaluation counts them
    assert thresholds.frame()["implausible"].isna().all()
    assert thresholds.frame()["critical"].sum() > harm.frame()["critical"].sum()
    files = {run: run.scenarios[0].with_suffix(".xosc").read_text("utf-8") for run in (harm, paper)}
    assert 'name="road_end"' not in files[harm]
    assert 'name="road_end" value="stand"' in files[paper]
