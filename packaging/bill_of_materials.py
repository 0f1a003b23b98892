"""What the program `sesamec` and its Python module are made of, from what cargo says: a bill of materials, and the licences to pass on.

    python3 packaging/bill_of_materials.py TARGET BOM LICENCES

`BOM` is written as CycloneDX 1.5, and `LICENCES` holds the texts that each package has in its folder. Packages are
those that cargo links into them for the platform `TARGET`, and the C library that one of them brings along;
programs of the build, and macros, are not part of it. The same sources give the same files, byte for byte.

Tools that write such bills write one for each crate of a workspace, beside its manifest, and take longer to compile
than this takes to read.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = "sesamec"
MODULE = "sesame-python"
TEXTS = re.compile(r"(licen[cs]e|copying|notice|unlicense|copyright)", re.IGNORECASE)

Package = tuple[str, str]


def cargo(*arguments: str) -> str:
    """What cargo prints, for the versions in Cargo.lock."""
    command = ["cargo", *arguments, "--locked"]
    return subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout


def linked(target: str) -> set[Package]:
    """Names and versions of the packages in program and module, themselves among them."""
    edges = ["--edges", "normal,no-proc-macro", "--prefix", "none", "--format", "{p}"]
    lines = cargo("tree", "--package", PROGRAM, "--package", MODULE, "--target", target, *edges).splitlines()
    words = (line.split() for line in lines if line)
    return {(name, version.removeprefix("v")) for name, version, *_ in words}


def reference(package: Package) -> str:
    """Its package URL."""
    name, version = package
    return f"pkg:cargo/{name}@{version}"


def component(manifest: dict[str, Any], checksum: str | None) -> dict[str, Any]:
    """A package as CycloneDX describes it. One of the workspace has no checksum."""
    package = (manifest["name"], manifest["version"])
    described: dict[str, Any] = {
        "type": "application" if manifest["name"] == PROGRAM else "library",
        "bom-ref": reference(package),
        "name": manifest["name"],
        "version": manifest["version"],
        # Older manifests write `MIT/Apache-2.0`.
        "licenses": [{"expression": manifest["license"].replace("/", " OR ")}],
        "purl": reference(package),
    }
    if manifest["description"]:
        described["description"] = " ".join(manifest["description"].split())
    if checksum is not None:
        described["hashes"] = [{"alg": "SHA-256", "content": checksum}]
    if manifest["repository"]:
        described["externalReferences"] = [{"type": "vcs", "url": manifest["repository"]}]
    return described


def sqlite(manifest: dict[str, Any]) -> dict[str, Any]:
    """SQLite, whose sources are a file of the package that links it."""
    header = (Path(manifest["manifest_path"]).parent / "sqlite3/sqlite3.h").read_text()
    found = re.search(r'#define SQLITE_VERSION\s+"([0-9.]+)"', header)
    assert found is not None, "sqlite3.h says its version"
    version = found[1]
    return {
        "type": "library",
        "bom-ref": f"pkg:generic/sqlite@{version}",
        "name": "sqlite",
        "version": version,
        "licenses": [{"license": {"id": "blessing"}}],
        "purl": f"pkg:generic/sqlite@{version}",
        "cpe": f"cpe:2.3:a:sqlite:sqlite:{version}:*:*:*:*:*:*:*",
    }


def bill(manifests: dict[Package, dict[str, Any]], resolve: dict[str, Any]) -> dict[str, Any]:
    """The bill of these packages."""
    lock = tomllib.loads((ROOT / "Cargo.lock").read_text())
    checksums = {(it["name"], it["version"]): it.get("checksum") for it in lock["package"]}
    components = {it: component(manifests[it], checksums[it]) for it in sorted(manifests)}
    by_id = {manifest["id"]: package for package, manifest in manifests.items()}
    needs = {
        by_id[node["id"]]: sorted({reference(by_id[it]) for it in node["dependencies"] if it in by_id})
        for node in resolve["nodes"]
        if node["id"] in by_id
    }
    program = next(it for it in components if it[0] == PROGRAM)
    described = components.pop(program)
    parts = list(components.values())
    for package in components:
        if package[0] == "libsqlite3-sys":
            parts.append(sqlite(manifests[package]))
            needs[package].append(parts[-1]["bom-ref"])
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {"component": described},
        "components": parts,
        "dependencies": [{"ref": reference(it), "dependsOn": needs[it]} for it in sorted(needs)],
    }


def licences(manifests: dict[Package, dict[str, Any]]) -> str:
    """The licences of what others wrote, and each text once, below the packages that have it."""
    holders: dict[str, list[str]] = {}
    for (name, version), manifest in sorted(manifests.items()):
        if manifest["source"] is None:
            continue
        title = f"{name} {version} ({manifest['license']})"
        folder = Path(manifest["manifest_path"]).parent
        files = [it for it in sorted(folder.iterdir()) if it.is_file() and TEXTS.match(it.name)]
        texts = [it.read_text(errors="replace").strip() for it in files]
        authors = ", ".join(manifest["authors"])
        for text in texts or [f"By {authors or 'its authors'}; the package holds no text of its licence."]:
            holders.setdefault(text, []).append(title)
    rule = "-" * 80
    sections = ["\n".join([rule, *titles, rule, "", text, ""]) for text, titles in holders.items()]
    return f"Packages by others in the program {PROGRAM}, and their licences.\n\n" + "\n".join(sections)


def main() -> None:
    target, bom, texts = sys.argv[1:]
    metadata = json.loads(cargo("metadata", "--format-version", "1", "--filter-platform", target))
    wanted = linked(target)
    manifests = {(it["name"], it["version"]): it for it in metadata["packages"]}
    manifests = {package: manifests[package] for package in wanted}
    Path(bom).write_text(json.dumps(bill(manifests, metadata["resolve"]), indent=2) + "\n")
    Path(texts).write_text(licences(manifests))


if __name__ == "__main__":
    main()
