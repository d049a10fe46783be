"""Holds a job for Kubernetes, as `terrane shard-plan` prints it, against the schemas of Kubernetes:

    python3 tests/kubernetes.py FILE

Takes the packages PyYAML and kubernetes-validate, which has the schemas that Kubernetes publishes.
"""

import sys

import kubernetes_validate
import yaml

# The first version in which failures are counted for each index unless that is switched off, and the last one that is known here.
VERSIONS = ["1.29", kubernetes_validate.latest_version()]


def main(path):
    with open(path, encoding="utf-8") as file:
        shards, merge = yaml.safe_load_all(file)
    for document in (shards, merge):
        for version in VERSIONS:
            kubernetes_validate.validate(document, version, strict=True)
    spec = shards["spec"]
    assert (spec["completionMode"], merge["spec"]["suspend"]) == ("Indexed", True)
    assert spec["completions"] == spec["parallelism"] >= 1
    # What a schema does not say: names of volumes are those of mounts, and a pod that fails is not begun again in its place.
    for document in (shards, merge):
        pod = document["spec"]["template"]["spec"]
        assert {mount["name"] for container in pod["containers"] for mount in container["volumeMounts"]} == {
            volume["name"] for volume in pod["volumes"]
        }
        assert pod["restartPolicy"] == "Never"
    try:
        kubernetes_validate.validate(shards | {"spec": spec | {"completion": 1}}, VERSIONS[0], strict=True)
    except kubernetes_validate.ValidationError:
        pass
    else:
        raise AssertionError("the schema takes a key that Kubernetes does not know")
    print(f"{path}: {spec['completions']} shards and a merge, as Kubernetes {' and '.join(VERSIONS)} takes them")


main(sys.argv[1])
