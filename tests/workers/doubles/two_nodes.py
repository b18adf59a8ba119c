"""A Ray cluster of two nodes on this machine, with a core each; obeys what it reads.

In a process of its own: Ray leaves files open, and starts threads, in that which begins it.
"""

import os
import sys

from ray.cluster_utils import Cluster


def main() -> None:
    port = int(sys.argv[1])
    head = {"num_cpus": 1, "include_dashboard": False, "ray_client_server_port": port}
    cluster = Cluster(initialize_head=True, head_node_args=head)
    second = cluster.add_node(num_cpus=1)
    print(cluster.address, flush=True)
    for order in sys.stdin:
        match order.strip():
            case "kill node":
                cluster.remove_node(second, allow_graceful=False)
            case "grow":
                second = cluster.add_node(num_cpus=1)
            case "kill head":
                cluster.head_node.kill_gcs_server(check_alive=False)
        print("done", flush=True)
    cluster.shutdown()
    os._exit(0)


main()
