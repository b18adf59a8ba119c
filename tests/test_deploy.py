"""The cluster's files: well formed, consistent, and what they run exists."""

import importlib.util
import re
import tomllib
from pathlib import Path

import pytest
import yaml
from typer.main import get_command

from bridgegen.cli import app
from bridgegen.engine.workers import read_choice

ROOT = Path(__file__).parents[1]
DEPLOY = ROOT / "deploy"
COMPOSE = yaml.safe_load((DEPLOY / "compose.yaml").read_text("utf-8"))
CLUSTER = yaml.safe_load((DEPLOY / "cluster.yaml").read_text("utf-8"))
HAS_RAY = importlib.util.find_spec("ray") is not None


def shell_commands() -> list[list[str]]:
    """Return every command of both files and the image, in words."""
    keys = ("setup_commands", "head_start_ray_commands", "worker_start_ray_commands")
    lines = [line for key in keys for line in CLUSTER[key]]
    lines += re.findall(r"^RUN (.*)$", (DEPLOY / "Dockerfile").read_text("utf-8"), re.M)
    commands = [part.split() for line in lines for part in line.split("&&")]
    commands += [one["command"] for one in COMPOSE["services"].values()]
    return [[Path(words[0]).name, *words[1:]] for words in commands]


def test_every_command_of_ours_can_be_parsed():
    ours = [words for words in shell_commands() if words[0] == "bridgegen"]
    assert len(ours) == 3
    for _, name, *rest in ours:
        command = get_command(app).commands[name]
        given = command.make_context(name, list(rest)).params
        if given["workers"]:
            assert read_choice(given["workers"]) == "ray://head:10001"


@pytest.mark.ray
@pytest.mark.skipif(not HAS_RAY, reason="ray is not installed")
def test_every_command_of_rays_can_be_parsed():
    from ray.scripts.scripts import cli

    rays = [words for words in shell_commands() if words[0] == "ray"]
    assert len(rays) == 7
    for _, name, *rest in rays:
        context = cli.commands[name].make_context(name, list(rest))
        if name == "start":
            assert context.params["head"] != bool(context.params["address"])


@pytest.mark.ray
@pytest.mark.skipif(not HAS_RAY, reason="ray is not installed")
def test_the_cluster_file_is_rays():
    from ray.autoscaler._private.util import prepare_config, validate_config

    validate_config(prepare_config(CLUSTER | {"file_mounts": {}}))


def test_the_clusters_counts_and_places_agree():
    provider = CLUSTER["provider"]
    assert CLUSTER["min_workers"] == CLUSTER["max_workers"] == len(provider["worker_ips"])
    placeholders = [provider["head_ip"], *provider["worker_ips"], CLUSTER["auth"]["ssh_user"]]
    assert all(re.fullmatch(r"[A-Z_0-9]+", one) for one in placeholders)
    for source in CLUSTER["file_mounts"].values():
        assert (ROOT / source / "pyproject.toml").is_file()  # `ray up` is run from there


def test_every_worker_has_a_server_of_its_own():
    services = COMPOSE["services"]
    workers = {name: one for name, one in services.items() if name.startswith("worker-")}
    servers = {name: one for name, one in services.items() if name.startswith("carla-")}
    hosts = [one["environment"]["CARLA_HOST"] for one in workers.values()]
    assert sorted(hosts) == sorted(servers)
    cards = [one["environment"]["NVIDIA_VISIBLE_DEVICES"] for one in servers.values()]
    assert len(set(cards)) == len(servers) == len(workers) >= 2
    for one in workers.values():
        assert set(one["depends_on"]) <= set(services)
        assert "--num-gpus=1" in one["command"]
        assert (
            f"-carla-rpc-port={one['environment']['CARLA_PORT']}"
            in servers[one["environment"]["CARLA_HOST"]]["command"]
        )
        assert one["image"] == services["search"]["image"] == services["head"]["image"]


def test_ports_and_versions_agree():
    head = COMPOSE["services"]["head"]["command"]
    assert "--port=6379" in head
    assert "--ray-client-server-port=10001" in head
    workers = [one for name, one in COMPOSE["services"].items() if name.startswith("worker-")]
    assert all("--address=head:6379" in one["command"] for one in workers)
    pins = (ROOT / "constraints.txt").read_text("utf-8")
    (client,) = re.findall(r"^carla==(.*)$", pins, re.M)
    assert COMPOSE["services"]["carla-1"]["image"] == f"carlasim/carla:{client}"
    assert re.search(r"^ray==", pins, re.M)
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    text = (DEPLOY / "Dockerfile").read_text("utf-8") + (DEPLOY / "cluster.yaml").read_text("utf-8")
    for named in re.findall(r"\[([a-z,]+)\]'?$", text, re.M):
        assert set(named.split(",")) <= set(extras["optional-dependencies"])
    for file in re.findall(r"^COPY (.*) \S+$", text, re.M):
        assert all((ROOT / one).exists() for one in file.split())
