//! What the program is built of: `deny.toml` says which licences, sources and crates may be. `cargo deny` checks the same and more, but
//! takes minutes to build.

use serde::Deserialize;
use spdx::Expression;
use std::collections::{HashMap, HashSet};
use std::path::Path;
use std::process::Command;

#[derive(Deserialize)]
struct Rules {
    licenses: Licenses,
    bans: Bans,
    sources: Sources,
}

#[derive(Deserialize)]
struct Licenses {
    allow: Vec<String>,
}

#[derive(Deserialize)]
struct Bans {
    deny: Vec<String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
struct Sources {
    allow_registry: Vec<String>,
}

#[derive(Deserialize)]
struct Metadata {
    packages: Vec<Package>,
    resolve: Resolve,
    workspace_members: Vec<String>,
}

#[derive(Deserialize)]
struct Resolve {
    nodes: Vec<Node>,
}

#[derive(Deserialize)]
struct Node {
    id: String,
    deps: Vec<Dependency>,
}

#[derive(Deserialize)]
struct Dependency {
    pkg: String,
    dep_kinds: Vec<Kind>,
}

#[derive(Deserialize)]
struct Kind {
    /// `dev`, `build`, or none.
    kind: Option<String>,
}

#[derive(Deserialize)]
struct Package {
    id: String,
    name: String,
    license: Option<String>,
    /// `None` for those of the workspace.
    source: Option<String>,
}

impl Metadata {
    /// What is shipped: all but what tests alone need.
    fn shipped(&self) -> Vec<&Package> {
        let nodes: HashMap<&str, &Node> = self.resolve.nodes.iter().map(|n| (n.id.as_str(), n)).collect();
        let mut found: HashSet<&str> = self.workspace_members.iter().map(String::as_str).collect();
        let mut open: Vec<&str> = found.iter().copied().collect();
        while let Some(id) = open.pop() {
            let is_shipped = |d: &&Dependency| d.dep_kinds.iter().any(|k| k.kind.as_deref() != Some("dev"));
            let next = nodes[id].deps.iter().filter(is_shipped).map(|d| d.pkg.as_str());
            open.extend(next.filter(|id| found.insert(id)));
        }
        self.packages.iter().filter(|p| found.contains(p.id.as_str())).collect()
    }
}

/// The packages that this machine would build for all features; needs crates.io where some are not here yet.
fn metadata() -> Metadata {
    let version = Command::new("rustc").arg("-vV").output().unwrap();
    let version = String::from_utf8(version.stdout).unwrap();
    let host = version.lines().find_map(|line| line.strip_prefix("host: ")).unwrap();
    let listed = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--locked", "--all-features", "--filter-platform", host])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    assert!(listed.status.success(), "{}", String::from_utf8_lossy(&listed.stderr));
    serde_json::from_slice(&listed.stdout).unwrap()
}

/// Whether a licence, with its exception, is one of those.
fn allows(allowed: &[String], licence: &str) -> bool {
    let expression = Expression::parse_mode(licence, spdx::ParseMode::LAX);
    expression.is_ok_and(|e| e.evaluate(|wanted| allowed.contains(&wanted.to_string())))
}

#[test]
#[ignore = "asks crates.io for packages of all features"]
fn dependencies_have_permissive_licences_known_sources_and_do_not_reach_the_web() {
    let rules = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../deny.toml");
    let rules: Rules = toml::from_str(&std::fs::read_to_string(rules).unwrap()).unwrap();
    let metadata = metadata();
    let packages = metadata.shipped();
    assert!(packages.len() > 100, "{} packages", packages.len());
    let sources: HashSet<String> =
        rules.sources.allow_registry.iter().map(|r| format!("registry+{r}")).collect();
    let mut wrong = Vec::new();
    for Package { name, license, source, .. } in packages {
        let license = license.as_deref().unwrap_or("none");
        if !allows(&rules.licenses.allow, license) {
            wrong.push(format!("{name}: the licence is {license}"));
        }
        if rules.bans.deny.contains(name) {
            wrong.push(format!("{name}: it may not be used"));
        }
        if source.as_ref().is_some_and(|s| !sources.contains(s)) {
            wrong.push(format!("{name}: it comes from {source:?}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn licences_are_weighed_as_they_are_joined() {
    let allowed = ["MIT", "Apache-2.0 WITH LLVM-exception"].map(str::to_owned);
    for (licence, is_fine) in [
        ("MIT", true),
        ("GPL-3.0-only OR MIT", true),
        ("MIT/Apache-2.0", true),
        ("MIT AND GPL-3.0-only", false),
        ("Apache-2.0 WITH LLVM-exception", true),
        ("Apache-2.0", false),
        ("none", false),
    ] {
        assert_eq!(allows(&allowed, licence), is_fine, "{licence}");
    }
}
