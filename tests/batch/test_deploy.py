"""The Kubernetes example asks for what there is: commands, ports, names that fit together."""

from pathlib import Path
from typing import Any

import pytest
import typer
import yaml

from objstate.cli.app import app

HOME = Path(__file__).parents[2] / "deploy" / "kubernetes"


def documents(name: str) -> list[dict[str, Any]]:
    return list(yaml.safe_load_all((HOME / name).read_text(encoding="utf-8")))


def container(document: dict[str, Any], *path: str) -> dict[str, Any]:
    for key in path:
        document = document[key]
    (only,) = document["containers"]
    return only


def test_the_batch_is_a_command_as_typed() -> None:
    (job,) = documents("batch.yaml")
    asked = container(job, "spec", "template", "spec")
    assert asked["command"] == ["objstate", "batch"]
    command = typer.main.get_command(app).commands["batch"]
    values = command.make_context("batch", [*asked["args"]]).params
    cluster, _ = documents("cluster.yaml")
    scheduler = f"tcp://{cluster['metadata']['name']}-scheduler:8786"
    assert values["scheduler"] == scheduler
    assert str(values["out"]).startswith("s3://")


@pytest.mark.parametrize("role", ["worker", "scheduler"])
def test_dask_understands_what_its_containers_are_started_with(role: str) -> None:
    cli = pytest.importorskip(f"distributed.cli.dask_{role}")
    cluster, _ = documents("cluster.yaml")
    asked = container(cluster, "spec", role, "spec")
    assert asked["command"] == ["dask", role]
    cli.main.make_context(role, [*asked["args"], *(["tcp://x:1"] if role == "worker" else [])])


def test_ports_and_names_fit_together() -> None:
    cluster, scaler = documents("cluster.yaml")
    assert scaler["spec"]["cluster"] == cluster["metadata"]["name"]
    service = cluster["spec"]["scheduler"]["service"]
    assert service["selector"]["dask.org/cluster-name"] == cluster["metadata"]["name"]
    offered = {port["name"] for port in container(cluster, "spec", "scheduler", "spec")["ports"]}
    assert {port["targetPort"] for port in service["ports"]} == offered
    secrets = {
        source["secretRef"]["name"]
        for each in (
            container(cluster, "spec", "worker", "spec"),
            container(documents("batch.yaml")[0], "spec", "template", "spec"),
        )
        for source in each["envFrom"]
    }
    assert len(secrets) == 1
