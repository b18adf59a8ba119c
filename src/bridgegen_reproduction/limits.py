"""What of Section V cannot be reproduced, and why."""

from bridgegen_reproduction import paper
from bridgegen_reproduction.numbers import number
from bridgegen_reproduction.protocol import Protocol


def limits(protocol: Protocol) -> tuple[tuple[str, str], ...]:
    """Return what cannot be reproduced, in a few words each, and the reason."""
    pso = paper.RESULTS["single", "pso"]
    random = [paper.RESULTS[group, "random"] for group in paper.GROUPS]
    follows = paper.fitness(pso["avg_d_min"], pso["avg_v_d"])
    place = (
        "Here: a generated crossroads; --map runs it on your copy of Town05."
        if protocol.road_map is None
        else f"Here: on {protocol.road_map.name}, but in our simulator."
    )
    known = [
        (
            "CARLA and the ego that drove in it",
            "The paper does not say which driver its ego was. Ours in its place keeps its route "
            "and its speed and sees nobody (route-follower), in a simulator of its own; so the "
            "absolute numbers of Table VI are not expected to agree, only their order. " + place,
        ),
        (
            "The ranges that were searched",
            "The paper prints one value of each parameter and no range. Ours are physical ones, "
            "with their sources, in the scenario files. How large a share of random scenarios is "
            "critical depends on them more than on anything else: the paper’s is "
            f"{random[0]['r_critic']:.2f}.",
        ),
        (
            "Fitness of PSO in Table VI",
            f"Printed {pso['avg_fitness']:g} and {pso['median_fitness']:g}; the row’s own d_min "
            f"and v_d give {number(follows, 2)} on average, by the same formula that gives the "
            "rows of RS and PPO.",
        ),
        (
            "The sign of the fitness",
            "Section V-B prints a1·d_min + a2·v_d; the rows of RS and PPO in Table VI are "
            "−a1·d_min + a2·v_d with v_d in km/h, and so is ours.",
        ),
        (
            "T_critic",
            f"It is not defined, and printed twice for RS: {paper.T_CRITIC_IN_THE_TEXT:g} in the "
            f"text, {random[0]['t_critic']:g} in Table VI. Ours counts "
            "evaluations until 5 % of the budget are critical.",
        ),
        (
            "Two samples of RS",
            f"The paper’s RS has R_critic {random[0]['r_critic']:.3f} among the methods of one "
            f"objective and {random[1]['r_critic']:.3f} among those of many. Random "
            "sampling knows no objective, so we run it once.",
        ),
        (
            "Seeds and spreads",
            "The paper gives one number a method, without seeds: whether one of ours differs from "
            "it by more than chance cannot be told.",
        ),
        (
            "Runtime",
            "About seven minutes in CARLA, whatever the method. Here the simulation takes so "
            "little that it is the methods’ own time that differs.",
        ),
        (
            "Curves of hypervolume and spread",
            "Printed as curves, without numbers, reference point or scale. Ours are scaled by what "
            "all runs of the scenario met, with the least critical corner as reference point.",
        ),
        (
            "The rest of PPO, and NSGA-II-DT’s tree",
            "The paper prints four hyper-parameters of PPO and two of NSGA-II-DT; observation, "
            "action, reward, networks and tree are ours (Tables IV and V).",
        ),
    ]
    if "ppo" in protocol.missing:
        known.insert(
            0,
            (
                "PPO, on this machine",
                "It needs the extra rl, which is not installed: pip install 'bridgegen[rl]', then "
                "run the same command again; what is done is kept.",
            ),
        )
    return tuple(known)
